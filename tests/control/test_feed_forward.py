"""What the model adds, against the closed form of a pendulum."""

import math

import numpy as np
import pytest

from manipcli.control.controller import ControllerOutput
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, Mimic
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState

PERIOD = 0.001
MASS, LENGTH = 2.0, 0.3


def pendulum():
    """A point on a rod, level at 0; its joint turns about -y, so that it rises with the angle."""
    inertial = Inertial(MASS, Transform.of(xyz=(LENGTH, 0.0, 0.0)), frozen(1e-6 * np.eye(3)))
    hinge = Joint("a", "revolute", "base", "rod", Transform.identity(), frozen([0.0, -1.0, 0.0]), JointLimits())
    return RobotModel(
        name="pendulum", root="base", links=(Link("base", None, (), ()), Link("rod", inertial, (), ())),
        joints=(hinge,), groups=(), poses=(), transmissions=(), X_WB=Transform.identity(), urdf="",
    )  # fmt: skip


def weight(q):
    return MASS * 9.81 * LENGTH * math.cos(q)


class Counts:
    """Commands how often it was updated; its reference accelerates at 2 rad/s2."""

    name, joints, senses_contact, sensors = "counts", ("a",), False, ()

    def __init__(self, feed_forward="gravity"):
        self.feed_forward, self.interfaces = feed_forward, ("effort",)
        self.output = ControllerOutput.of(1, 1)
        self.updates = 0

    def update(self, time, period, measured, *, contact_force=None):
        self.updates += 1
        self.output.acceleration[:] = 2.0
        self.output.command[:] = self.updates
        return self.output

    def deactivate(self, time, reason="deactivated"):
        pass


def at(q):
    none = np.zeros((0, 3))
    return WorldState(
        time=np.zeros(()), position=np.array([q]), velocity=np.zeros(1), effort=np.zeros(1), body_position=none,
        body_quat_xyzw=np.zeros((0, 4)), body_linear=none, body_angular=none,
    )  # fmt: skip


@pytest.mark.parametrize("every", [1, 4])
def test_gravity_is_added_once_an_update_whenever_a_controller_was_activated(every):
    """Of the posture of its last update, at each of the ticks up to the next."""
    robot = pendulum()
    law = ModelFeedForward(robot, Kinematics(robot))
    manager = ControllerManager(joints=("a",), period=PERIOD, feed_forward=law)
    manager.load(Counts(), update_rate=1.0 / (every * PERIOD))
    manager.configure("counts")
    first = 3
    for tick in range(first + 12):
        if tick == first:
            manager.switch(["counts"])
        command = manager.update(tick * PERIOD, at(0.1 * tick))
        if tick < first:
            assert command.effort[0] == 0.0
        else:
            k = (tick - first) // every
            assert command.effort[0] == pytest.approx(1 + k + weight(0.1 * (first + every * k)), rel=1e-6)


def linkage(multiplier):
    """A rod on a hinge, and on another hinge a second one of the same weight that follows the first."""
    rod = Inertial(MASS, Transform.of(xyz=(LENGTH, 0.0, 0.0)), frozen(1e-6 * np.eye(3)))
    hinges = tuple(
        Joint(
            name, "revolute", "base", name + "_rod", Transform.identity(), frozen([0.0, -1.0, 0.0]), JointLimits(),
            mimic=mimic, damping=0.5,
        )
        for name, mimic in (("f", Mimic("a", multiplier, 0.3)), ("a", None))
    )  # fmt: skip
    links = (Link("base", None, (), ()), *(Link(f"{name}_rod", rod, (), ()) for name in "fa"))
    return RobotModel(
        name="linkage", root="base", links=links, joints=hinges, groups=(), poses=(), transmissions=(),
        X_WB=Transform.identity(), urdf="",
    )  # fmt: skip


@pytest.mark.parametrize("multiplier", [1.0, -2.0])
@pytest.mark.parametrize("wants", ["gravity", "inverse_dynamics"])
def test_a_joint_also_carries_what_follows_it(wants, multiplier):
    """Power: u q' = d(energy)/dt with q'_f = m q', so u = w(q) + m w(q_f) + (1 + m^2) (I a + D v_r)."""
    robot = linkage(multiplier)
    law = ModelFeedForward(robot, Kinematics(robot))
    controller = Counts(wants)
    controller.output.velocity[:], controller.output.acceleration[:] = 0.7, 2.0
    law.serve([(controller, slice(1, 2), 1, 0)])
    q = 0.4
    follower = multiplier * q + 0.3
    law.add(0, np.array([follower, q]), np.zeros(2))
    expected = weight(q) + multiplier * weight(follower)
    if wants == "inverse_dynamics":
        inertia = MASS * LENGTH**2 + 1e-6
        expected += (1.0 + multiplier**2) * (inertia * 2.0 + 0.5 * 0.7)
    assert controller.output.command[0] == pytest.approx(expected, rel=1e-6)
