"""Computed torque on the exact model: errors obey e'' + d e' + p e = 0, whatever the robot does meanwhile."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.computed_torque import ComputedTorqueController
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument
from manipcli.model.build_robot import build_robot
from manipcli.model.kinematics import Kinematics
from manipcli.model.state import WorldState
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import GainsSpec
from manipcli.spec.load import load_robot

ROBOT = Path(__file__).parents[3] / "robots" / "arm7_hand3" / "robot.yaml"
PERIOD = 5e-4
JOINTS = tuple(f"joint_{k}" for k in range(1, 8))
HOME = np.array([0.2, 0.4, -0.3, -1.2, 0.5, 0.6, -0.4])


@pytest.fixture(scope="module")
def robot():
    file = load_robot(ROBOT)
    built = build_robot(file.spec, file=ROBOT, source=file.source)[0]
    # Damping of the joints would be on top of the law's.
    return replace(built, joints=tuple(replace(joint, damping=0.0) for joint in built.joints))


def world(q, v):
    none = np.zeros((0, 3))
    return WorldState(np.zeros(()), q, v, np.zeros_like(q), none, np.zeros((0, 4)), none, none)


def simulate(robot, controller, q, ticks, before=lambda k: None):
    """(T, 7) positions of the arm, moved by M^-1 (u - C v - g); the hand's joints are held where they are."""
    kinematics = Kinematics(robot)
    manager = ControllerManager(
        [controller], joints=robot.joint_names, period=PERIOD, feed_forward=ModelFeedForward(robot, kinematics)
    )
    model = Kinematics(robot)
    arm = robot.indices(JOINTS)
    q, v, a = np.array(q), np.zeros(len(q)), np.zeros(len(q))
    seen = []
    for k in range(ticks):
        before(k)
        seen.append(q[arm].copy())
        command = manager.update(k * PERIOD, world(q, v))
        bias = model.inverse_dynamics(q, v, np.zeros(len(q)))
        effort = (command.effort - bias)[arm]
        a[arm] = np.linalg.solve(model.mass_matrix(q)[np.ix_(arm, arm)], effort)
        v += PERIOD * a
        q += PERIOD * v
    return np.array(seen)


def whole(robot, arm):
    q = np.zeros(len(robot.joint_names))
    q[robot.indices(JOINTS)] = arm
    return q


@pytest.mark.parametrize("ratio", [1.0, 0.5])
def test_an_error_decays_as_the_bandwidth_and_the_damping_say(robot, ratio):
    """Critically damped: e = e0 (1 + w t) exp(-w t); below that, a ringing at w sqrt(1 - ratio^2)."""
    bandwidth = 4.0
    controller = ComputedTorqueController(name="arm", joints=JOINTS, bandwidth=bandwidth, damping_ratio=ratio)
    step = np.array([0.1, -0.05, 0.08, 0.02, -0.1, 0.05, 0.06])
    target = tuple(HOME + step)
    points = [TrajectoryPoint(target, 0.0), TrajectoryPoint(target, 1.0)]

    def jump(k):
        if k == 0:
            controller.send_goal(JointTrajectory(JOINTS, points))

    seen = simulate(robot, controller, whole(robot, HOME), 800, jump)
    w, t = math.tau * bandwidth, np.arange(800) * PERIOD
    if ratio == 1.0:
        shape = (1 + w * t) * np.exp(-w * t)
    else:
        d = w * math.sqrt(1 - ratio**2)
        shape = np.exp(-ratio * w * t) * (np.cos(d * t) + ratio * w / d * np.sin(d * t))
    # A command that is held for a period acts half a period late: an error of the order w T of the step.
    np.testing.assert_allclose(HOME + step - seen, np.outer(shape, step), atol=0.5 * w * PERIOD * 0.1)


def test_a_fast_trajectory_is_followed_to_a_fraction_of_a_milliradian(robot):
    controller = ComputedTorqueController(name="arm", joints=JOINTS)
    goal = HOME + 0.4
    times = np.linspace(0.0, 0.8, 81)
    x = times / times[-1]
    blend, rate = 10 * x**3 - 15 * x**4 + 6 * x**5, (30 * x**2 - 60 * x**3 + 30 * x**4) / times[-1]
    curve = (60 * x - 180 * x**2 + 120 * x**3) / times[-1] ** 2
    columns = [np.outer(shape, goal - HOME) for shape in (blend, rate, curve)]
    columns[0] += HOME
    trajectory = JointTrajectory.of_arrays(JOINTS, times, *columns)
    handles = []

    def start(k):
        if k == 0:
            handles.append(controller.send_goal(trajectory))

    seen = simulate(robot, controller, whole(robot, HOME), 1900, start)
    wanted = trajectory.sample(np.minimum(np.arange(1900) * PERIOD, times[-1]))[0]
    assert np.sqrt(np.mean((seen - wanted) ** 2)) < 3e-4
    assert handles[0].status == "succeeded"


def test_gains_of_a_joint_replace_those_of_the_bandwidth():
    controller = ComputedTorqueController(name="arm", joints=("a", "b"), bandwidth=1.0, gains={"b": GainsSpec(p=7.0)})
    first = JointState(np.zeros(2), np.zeros(2), np.zeros(2))
    controller.update(0.0, PERIOD, first)
    moved = JointState(np.array([-1.0, -1.0]), np.array([0.5, 0.5]), np.zeros(2))
    output = controller.update(PERIOD, PERIOD, moved)
    w = math.tau
    assert output.wanted_acceleration == pytest.approx([w * w - 2 * w * 0.5, 7.0])
    assert output.command.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ({"bandwidth": 0.0}, "bandwidth"),
        ({"gains": {"z": GainsSpec(p=1)}}, "'z'"),
        ({"gains": {"a": GainsSpec()}}, "'a' are all zero"),
        ({"joints": ("a", "a")}, "distinct"),
    ],
)
def test_what_would_not_work_is_refused(more, named):
    with pytest.raises(InvalidArgument, match=named):
        ComputedTorqueController(**({"name": "arm", "joints": ("a", "b")} | more))
