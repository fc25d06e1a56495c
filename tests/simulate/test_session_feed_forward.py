"""What is added to an effort command, seen by a controller that commands it and nothing else."""

import numpy as np
import pytest

from manipcli.control.controller import ControllerOutput
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Transform, frozen
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import Inertial, Joint, JointLimits, Link, RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.simulate.session import Session

RATE, ACCELERATION = np.array([0.7, -0.3]), np.array([2.0, 1.0])
DAMPING = (0.5, 4.0)


def robot():
    def link(name):
        inertial = Inertial(1.0, Transform.of(xyz=(0.1, 0.0, 0.0)), frozen(0.01 * np.eye(3)))
        return Link(name=name, inertial=inertial, visuals=(), collisions=())

    joints = tuple(
        Joint(
            name=name, type="revolute", parent=parent, child=name + "_link", X_PJ=Transform.of(xyz=(0.2, 0.0, 0.0)),
            axis=frozen([0.0, 1.0, 0.0]), limits=JointLimits(-3.0, 3.0, 9.0, 99.0), damping=damping,
        )
        for name, parent, damping in zip(("a", "b"), ("base", "a_link"), DAMPING, strict=True)
    )  # fmt: skip
    return RobotModel(
        name="toy", root="base", links=(link("base"), link("a_link"), link("b_link")), joints=joints, groups=(),
        poses=(), transmissions=(), X_WB=Transform.identity(), urdf="",
    )  # fmt: skip


class Echo:
    """Commands nothing itself; its reference moves at RATE."""

    name, joints, interfaces, role = "echo", ("a", "b"), ("effort",), None

    def __init__(self, feed_forward):
        self.feed_forward = feed_forward
        self.output = ControllerOutput.of(2, 1)

    def update(self, time, period, measured, *, contact_force=None):
        self.output.velocity[:] = RATE
        self.output.acceleration[:] = ACCELERATION
        self.output.command[:] = 0.0
        return self.output

    def deactivate(self, time, reason=""):
        pass


class Standing:
    """An engine whose robot does not move, whatever it is told."""

    ideal = False

    def __init__(self, position):
        none = np.zeros((0, 3))
        self.state = WorldState(
            time=np.zeros(()), position=position, velocity=np.zeros(2), effort=np.zeros(2), body_position=none,
            body_quat_xyzw=np.zeros((0, 4)), body_linear=none, body_angular=none,
        )  # fmt: skip

    def read(self, *, velocities=True):
        return self.state

    def write(self, command):
        self.written = command.effort.copy()

    def advance(self):
        pass

    def touches_changed(self):
        return False

    def contacts(self):
        return ()

    def close(self):
        pass


@pytest.mark.parametrize("wants", ["gravity", "inverse_dynamics"])
def test_inverse_dynamics_also_overcomes_the_damping_of_the_joints_at_the_reference_velocity(wants):
    q = np.array([0.4, -1.1])
    model = robot()
    kinematics = Kinematics(model)
    engine = Standing(q)
    law = ModelFeedForward(model, kinematics)
    manager = ControllerManager([Echo(wants)], joints=model.joint_names, period=0.001, feed_forward=law)
    session = Session(
        robot=model,
        scene=Scene(bodies=(), frames=(), gravity=frozen([0.0, 0.0, -9.81])),
        engine=engine,
        manager=manager,
        period=0.001,
    )
    session.tick()
    expected = kinematics.gravity(q).copy()
    if wants == "inverse_dynamics":
        expected += kinematics.mass_matrix(q) @ ACCELERATION + np.array(DAMPING) * RATE
    np.testing.assert_allclose(engine.written, expected, rtol=1e-9)
