"""What is added to an effort command, seen by a controller that commands it and nothing else."""

import numpy as np
import pytest

from manipcli.control.controller import ControllerOutput
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.session import Session

RATE, ACCELERATION = np.array([0.7, -0.3]), np.array([2.0, 1.0])
Q, V = np.array([0.4, -1.1]), np.array([0.6, -0.9])
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

    name, joints, interfaces, role, sensors = "echo", ("a", "b"), ("effort",), None, ()

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

    def contacts(self, *, peek=False):
        return ()

    def close(self):
        pass


@pytest.mark.parametrize("wants", ["gravity", "inverse_dynamics"])
def test_inverse_dynamics_also_overcomes_the_damping_of_the_joints_at_the_reference_velocity(wants):
    model = robot()
    kinematics = Kinematics(model)
    engine = Standing(Q)
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
    expected = kinematics.gravity(Q).copy()
    if wants == "inverse_dynamics":
        expected += kinematics.mass_matrix(Q) @ ACCELERATION + np.array(DAMPING) * RATE
    np.testing.assert_allclose(engine.written, expected, rtol=1e-9)


class Half(Echo):
    """Commands one joint; its reference is as `Echo`'s."""

    def __init__(self, joint, feed_forward, interface="effort"):
        self.name, self.joints, self.interfaces, self.feed_forward = joint, (joint,), (interface,), feed_forward
        self.output = ControllerOutput.of(1, 1)
        self.output.velocity[:] = RATE["ab".index(joint)]
        self.output.acceleration[:] = ACCELERATION["ab".index(joint)]


def fed(law, *halves):
    """The efforts of both joints that the law adds."""
    law.serve([(half, slice("ab".index(half.name), "ab".index(half.name) + 1), 1, 0) for half in halves])
    for half in halves:
        half.output.command[:] = 0.0
    law.add(0, Q, V)
    return {half.name: half.output.command[0] for half in halves}


def test_after_a_switch_nothing_is_left_of_the_acceleration_that_was_wanted_before():
    """Joints of which nobody wants an acceleration now are taken not to accelerate."""
    model = robot()
    kinematics = Kinematics(model)
    law = ModelFeedForward(model, kinematics)
    both = kinematics.inverse_dynamics(Q, V, ACCELERATION) + DAMPING * RATE
    found = fed(law, Half("a", "inverse_dynamics"), Half("b", "inverse_dynamics"))
    assert found == pytest.approx(dict(zip("ab", both, strict=True)))
    alone = kinematics.inverse_dynamics(Q, V, np.array([0.0, ACCELERATION[1]])) + np.array([0.0, DAMPING[1] * RATE[1]])
    found = fed(law, Half("a", "gravity"), Half("b", "inverse_dynamics"))
    assert found == pytest.approx(dict(zip("ab", alone, strict=True)))


@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_nothing_is_added_to_what_is_no_effort(interface):
    model = robot()
    kinematics = Kinematics(model)
    law = ModelFeedForward(model, kinematics)
    found = fed(law, Half("a", "gravity", interface), Half("b", "gravity"))
    assert found == pytest.approx({"a": 0.0, "b": kinematics.gravity(Q)[1]})
    assert fed(law, Half("a", "inverse_dynamics", interface)) == {"a": 0.0}
