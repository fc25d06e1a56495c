"""ROS 2's rules for its trajectory controller, one test a case: joint1..3 at 1.1, 2.1, 3.1, moved by hand.

"Frozen" joints never move; "ideal" ones are at the next tick where their position is commanded.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from manipcli.control import (
    ConstraintsSpec,
    ErrorCode,
    GainsSpec,
    GoalRejected,
    JointConstraintSpec,
    JointState,
    JointTolerance,
    JointTrajectory,
    JointTrajectoryController,
    TrajectoryGoal,
    TrajectoryPoint,
)
from manipcli.control.controllers.joint_trajectory import JointTrajectorySpec, check
from manipcli.core.errors import InvalidArgument

JOINTS = ("joint1", "joint2", "joint3")
START = np.array([1.1, 2.1, 3.1])
PERIOD = 0.01


def controller(*interfaces, path=None, goal=None, goal_time=2.0, stopped=0.0, joints=JOINTS, **more):
    constraints = ConstraintsSpec(
        goal_time=goal_time,
        stopped_velocity_tolerance=stopped,
        joints={joint: JointConstraintSpec(trajectory=path, goal=goal) for joint in joints},
    )
    return JointTrajectoryController(
        name="arm",
        joints=joints,
        command_interfaces=interfaces or ("position",),
        gains=more.pop("gains", {joint: GainsSpec(p=1.0) for joint in joints}),
        constraints=more.pop("constraints", constraints),
        **more,
    )


class Bench:
    """Ticks a controller; `ideal` joints follow the command, others stay where they are."""

    def __init__(self, made, *, ideal=False, at=START):
        self.controller, self.ideal = made, ideal
        self.position, self.velocity = np.array(at, dtype=float), np.zeros(len(at))
        self.tick = 0
        self.commands = []
        self.run(1)

    @property
    def time(self):
        """Of the next update."""
        return self.tick * PERIOD

    def run(self, ticks):
        for _ in range(ticks):
            measured = JointState(self.position, self.velocity, np.zeros_like(self.position))
            output = self.controller.update(self.time, PERIOD, measured)
            self.commands.append(output.command.copy())
            self.tick += 1
            if self.ideal:
                self.position, self.velocity = output.command.copy(), output.velocity.copy()
        return output

    def end(self, handle, within=1000):
        """Runs until the goal ends; the time that it took."""
        began = self.time
        for _ in range(within):
            if not handle.active:
                return self.time - began
            self.run(1)
        raise AssertionError(f"still active after {within} ticks")


def point(positions, time, **more):
    return TrajectoryPoint(positions, time, **more)


def to(*points, names=JOINTS):
    return JointTrajectory(names, points)


@pytest.mark.parametrize(
    "build",
    [
        lambda: to(point([1, 2, 3], 1.0), names=("joint1", "joint2", "bad_name")),
        lambda: to(),
        lambda: to(point(None, 1.0)),
        lambda: to(point([1, 2], 1.0)),
        lambda: to(point([1, 2, 3, 4], 1.0)),
        lambda: to(point([1, 2, 3], 1.0, velocities=[0, 0])),
        lambda: to(point([1, 2, 3], 1.0, velocities=[0, 0, 0], accelerations=[0, 0])),
        lambda: to(point([1, 2, 3], 1.0, effort=[0, 0, 0])),
        lambda: to(point([1, 2, 3], 1.0), point([1, 2, 3], 1.0)),
        lambda: TrajectoryGoal(to(point([1, 2, 3], 0.1)), start_time=0.05),
        lambda: to(point([1, 2, 3], 1.0, velocities=[-1, -2, -3])),
        # What ROS takes in silence:
        lambda: to(point([1, math.nan, 3], 1.0)),
        lambda: to(point([1, 2, 3], 1.0), names=("joint1", "joint2", "joint2")),
        lambda: to(point([1, 2, 3], 1.0, accelerations=[0, 0, 0])),
        lambda: to(point([1, 2, 3], -0.1)),
    ],
)
def test_38_goals_that_are_refused(build):
    """Conformance 38: whatever is wrong, the goal before goes on."""
    bench = Bench(controller())
    before = bench.controller.send_goal(to(point([1, 2, 3], 5.0)))
    bench.run(20)
    with pytest.raises(InvalidArgument):
        bench.controller.send_goal(build())
    assert before.active


def test_38_a_velocity_at_the_end_where_it_is_allowed():
    """Conformance 38: accepted with allow_nonzero_velocity_at_trajectory_end; here the end is held at rest."""
    bench = Bench(controller(allow_nonzero_velocity_at_trajectory_end=True), ideal=True)
    handle = bench.controller.send_goal(to(point([0, 0, 0], 0.1, velocities=[-1, -2, -3])))
    bench.end(handle)
    assert handle.status == "succeeded"
    assert not bench.run(2).velocity.any()


def test_39_jumbled_order_and_goals_of_some_joints():
    """Conformance 39: each joint gets its own value; one that is left out stays at its command."""
    bench = Bench(controller())
    bench.controller.send_goal(to(point([3, 1, 2], 0.1), names=("joint3", "joint1", "joint2")))
    assert bench.run(12).command == pytest.approx([1, 2, 3])

    bench = Bench(controller(allow_partial_joints_goal=True))
    bench.controller.send_goal(to(point([2.0, 1.0], 0.1), names=("joint2", "joint1")))
    assert bench.run(12).command == pytest.approx([1.0, 2.0, 3.1])

    bench = Bench(controller())
    with pytest.raises(GoalRejected, match="no values for joint 'joint3'") as refused:
        bench.controller.send_goal(to(point([2.0, 1.0], 0.1), names=("joint2", "joint1")))
    assert refused.value.error_code is ErrorCode.INVALID_JOINTS
    assert np.array_equal(bench.run(12).command, START)


@pytest.mark.parametrize("field", ["velocities", "accelerations"])
def test_40_points_without_positions(field):
    """Conformance 40: integrated where that is allowed; a point that gives nothing never is."""
    goal = to(point(None, 0.5, **{field: [1, 2, 3]}), point(None, 1.0, **{field: [0, 0, 0]}))
    with pytest.raises(GoalRejected, match="integrating them is not allowed"):
        Bench(controller()).controller.send_goal(goal)
    allowed = {"allow_integration_in_goal_trajectories": True, "allow_nonzero_velocity_at_trajectory_end": True}
    bench = Bench(controller(**allowed), ideal=True)
    handle = bench.controller.send_goal(goal)
    bench.end(handle)
    assert handle.status == "succeeded"
    # Velocities: 0.25 and 0.25 of the rate in each half; accelerations: v = 0.25, 0.5 and p = 0.0625, 0.25.
    gain = 0.5 if field == "velocities" else 0.25
    assert bench.position == pytest.approx(START + gain * np.array([1, 2, 3]))
    with pytest.raises(InvalidArgument, match="0 positions"):
        to(point(None, 1.0))


def tolerances_of(made, **more):
    goal = TrajectoryGoal(to(point([1, 2, 3], 1.0)), **more)
    return made.send_goal(goal), made.tolerances


def each(values, names=JOINTS, **factors):
    return tuple(
        JointTolerance(name, *(factor * value for factor in factors.values()))
        for name, value in zip(names, values, strict=True)
    )


def test_41_tolerances_of_a_goal():
    """Conformance 41: those of a goal count for it alone; -1 disables; nonsense leaves the whole set as it was."""
    made = controller(path=0.1, goal=0.1, stopped=0.1, goal_time=0.1)
    jumbled = (
        JointTolerance("joint3", 3.1, 3.2, 3.3), JointTolerance("joint1", 1.1, 1.2, 1.3),
        JointTolerance("joint2", 2.1, 2.2, 2.3),
    )  # fmt: skip
    _, adopted = tolerances_of(
        made, path_tolerance=each((0.2, 0.3, 0.4), position=1), goal_tolerance=jumbled, goal_time_tolerance=2.0
    )
    assert adopted.path[0] == pytest.approx([0.2, 0.3, 0.4])
    assert adopted.goal == pytest.approx(np.array([[1.1, 2.1, 3.1], [1.2, 2.2, 3.2], [1.3, 2.3, 3.3]]))
    assert adopted.goal_time == 2.0

    def is_default(tolerances):
        return (
            tolerances.path[0].tolist() == [0.1] * 3
            and tolerances.goal[:2].tolist() == [[0.1] * 3] * 2
            and tolerances.goal_time == 0.1
        )

    assert is_default(tolerances_of(made)[1])
    none = each((-1.0,) * 3, position=1, velocity=1, acceleration=1)
    _, adopted = tolerances_of(made, path_tolerance=none, goal_tolerance=none, goal_time_tolerance=-1.0)
    assert np.isinf([adopted.path, adopted.goal]).all()
    assert adopted.goal_time == math.inf
    for wrong in (
        {"path_tolerance": each((-123.0, 0.2, 0.2), position=1)},
        {"goal_tolerance": each((0.2, 0.2, -123.0), position=0, velocity=1)},
        {"path_tolerance": each((0.2,) * 3, position=1), "goal_time_tolerance": -123.0},
        {"path_tolerance": (JointTolerance("joint1", 0.5), JointTolerance("nobody", 0.5))},
        {"goal_tolerance": each((math.nan,) * 3, position=1)},
    ):
        handle, adopted = tolerances_of(made, **wrong)
        assert is_default(adopted)
        assert "the controller's own tolerances apply" in handle.notes[0]


def test_42_a_frozen_joint_leaves_its_path_tolerance():
    """Conformance 42: a point at 0 s and joints that do not move: -4, then the command is where they are."""
    bench = Bench(controller(path=1e-4))
    handle = bench.controller.send_goal(to(point([4, 5, 6], 0.0)))
    output = bench.run(1)
    assert (handle.status, handle.result.code) == ("aborted", ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert np.array_equal(output.command, START)
    assert np.array_equal(bench.run(5).command, START)


def test_43_a_frozen_joint_misses_its_goal():
    """Conformance 43: a goal tolerance and a goal_time of 1e-6 s: -5, then the command is where they are."""
    bench = Bench(controller(goal=0.1, goal_time=1e-6))
    handle = bench.controller.send_goal(to(point([4, 5, 6], 0.5)))
    took = bench.end(handle)
    assert handle.result.code is ErrorCode.GOAL_TOLERANCE_VIOLATED
    assert took == pytest.approx(0.5 + 2 * PERIOD)
    assert np.array_equal(bench.run(1).command, START)


def test_44_the_first_sample_is_checked_though_it_is_the_last():
    """Conformance 44: the path tolerance counts at the first sample, also of a trajectory of one point at 0 s."""
    for off, ended in ((0.2, True), (0.05, False)):
        bench = Bench(controller(path=0.1, goal=0.01))
        handle = bench.controller.send_goal(to(point(START + off, 0.0)))
        bench.run(1)
        assert (not handle.active) == ended


def test_45_cancel_deactivate_preempt():
    """Conformance 45: canceled and held; deactivated: -1; preempted: -1, and the text says so."""
    bench = Bench(controller(), ideal=True)
    handle = bench.controller.send_goal(to(point([2, 3, 4], 1.0)))
    bench.run(50)
    handle.cancel()
    assert (handle.status, handle.result.code) == ("canceled", ErrorCode.SUCCESSFUL)
    bench.run(1)
    held = bench.run(1).command.copy()
    assert np.array_equal(bench.run(50).command, held)
    assert held == pytest.approx(START + 0.51 * (np.array([2, 3, 4]) - START), abs=0.02)

    handle = bench.controller.send_goal(to(point([2, 3, 4], 1.0)))
    bench.run(5)
    bench.controller.deactivate(bench.time)
    assert (handle.status, handle.result.code) == ("aborted", ErrorCode.INVALID_GOAL)

    first = bench.controller.send_goal(to(point([2, 3, 4], 1.0)))
    bench.run(5)
    second = bench.controller.send_goal(to(point([2, 3, 4], 1.0)))
    assert (first.status, first.result.code) == ("aborted", ErrorCode.INVALID_GOAL)
    assert "preempted" in first.result.text
    bench.end(second)
    assert second.status == "succeeded"


def test_46_a_goal_that_is_never_reached_times_out():
    """Conformance 46: cmd_timeout 0.1 after 3 x 0.25 s: the last position is held at rest."""
    points = [point(START + 0.1 * k, 0.25 * k) for k in (1, 2, 3)]
    bench = Bench(controller(goal=1e-3, goal_time=0.0, cmd_timeout=0.1, compat="ros2"))
    handle = bench.controller.send_goal(to(*points))
    assert bench.end(handle) == pytest.approx(0.85 + 2 * PERIOD)
    assert handle.result.text.endswith("after the end (goal_time unlimited), cmd_timeout 0.1 s")
    output = bench.run(10)
    assert output.command == pytest.approx(START + 0.3)
    assert not output.velocity.any()


def test_46_a_timeout_within_goal_time_counts_for_nothing():
    """Conformance 46: 3 s beside a goal_time of 2 s is taken, 2 s are not."""
    assert controller(cmd_timeout=3.0, goal_time=2.0).notes == ()
    assert "cmd_timeout 2 s" in controller(cmd_timeout=2.0, goal_time=2.0).notes[0]
    bench = Bench(controller(goal=1e-3, goal_time=2.0, cmd_timeout=0.1))
    handle = bench.controller.send_goal(to(point(START + 1, 0.1)))
    assert bench.end(handle) == pytest.approx(2.1 + 2 * PERIOD)
    assert "cmd_timeout" not in handle.result.text


def test_48_speed_scaling():
    """Conformance 48: half the speed takes twice the time, 0 freezes, negative factors are ignored."""
    goal = to(point(START + 1, 1.0, velocities=[0, 0, 0]))
    times = []
    for speed in (1.0, 0.5):
        bench = Bench(controller(path=0.1, goal=1e-3, speed_scaling=speed), ideal=True)
        handle = bench.controller.send_goal(goal)
        times.append(bench.end(handle))
        assert handle.status == "succeeded"
    assert times[1] == pytest.approx(2 * times[0], abs=2 * PERIOD)

    bench = Bench(controller(), ideal=True)
    handle = bench.controller.send_goal(goal)
    bench.run(30)
    bench.controller.scaling.set(0.0, at_once=True)
    bench.run(1)
    frozen = bench.run(1).command.copy()
    assert np.array_equal(bench.run(100).command, frozen)
    assert not bench.controller.output.velocity.any()
    assert handle.active
    assert handle.feedback().elapsed == pytest.approx(0.29)
    assert bench.controller.scaling.set(1.0, at_once=True)
    assert bench.end(handle) == pytest.approx(0.71)
    assert bench.controller.scaling.set(0.765, at_once=True)
    assert bench.controller.scaling.factor == 0.765
    assert bench.controller.scaling.set(0.45, at_once=True)
    for ignored in (-0.12, math.nan, math.inf):
        assert not bench.controller.scaling.set(ignored, at_once=True)
    assert bench.controller.scaling.factor == 0.45


def test_49_an_immediate_replacement_does_not_jump():
    """Conformance 49: at half the speed no step is above 0.3, though the goals are far apart."""
    bench = Bench(controller(speed_scaling=0.5), ideal=True)
    bench.controller.send_goal(to(point([10, 10, 10], 0.5), point([0, 0, 0], 1.0)))
    bench.run(60)
    second = bench.controller.send_goal(to(point([-5, 5, 0], 1.0)))
    bench.end(second)
    assert np.abs(np.diff(bench.commands, axis=0)).max() < 0.3
    assert bench.position == pytest.approx([-5, 5, 0])


def test_49_the_old_path_is_followed_until_the_new_one_starts():
    """Conformance 49: a goal that starts at 0.8 s lets the old one pass its peak of 10 at 0.5 s."""
    bench = Bench(controller(), ideal=True)
    bench.controller.send_goal(to(point([10, 10, 10], 0.5), point([0, 0, 0], 1.0)))
    bench.run(20)
    second = bench.controller.send_goal(TrajectoryGoal(to(point([5, 5, 5], 0.5)), start_time=0.8))
    bench.run(45)
    assert np.max(bench.commands[20:], axis=0).min() > 8.0
    assert second.feedback().elapsed < 0.0
    bench.end(second)
    assert bench.time == pytest.approx(0.8 + 0.5 + 2 * PERIOD, abs=2 * PERIOD)
    assert np.abs(np.diff(bench.commands, axis=0)).max() < 0.25  # the old path's own steps: 10 rad in 0.5 s
    assert bench.position == pytest.approx([5, 5, 5])


def test_49_joints_that_a_replacement_leaves_out_stay_on_the_old_path():
    """Conformance 49: the target is mixed, and the old path of a joint that was left out is kept."""
    old = to(point([10, 10, 10], 0.5), point([0, 1, 2], 1.0))
    alone, replaced = (Bench(controller(allow_partial_joints_goal=True), ideal=True) for _ in range(2))
    for bench in (alone, replaced):
        bench.controller.send_goal(old)
        bench.run(30)
    handle = replaced.controller.send_goal(to(point([5], 0.3), names=("joint2",)))
    for bench in (alone, replaced):
        bench.run(90)
    assert handle.status == "succeeded"
    left_out = [np.array(bench.commands)[:, [0, 2]] for bench in (alone, replaced)]
    assert left_out[0] == pytest.approx(left_out[1], abs=1e-12)
    assert replaced.position == pytest.approx([0, 5, 2])


def test_49_without_replacement_the_old_path_ends_at_once():
    """Conformance 49: a goal in the future then leads in from now, and joints that it leaves out are held."""
    bench = Bench(controller(allow_trajectory_replacement=False, allow_partial_joints_goal=True), ideal=True)
    bench.controller.send_goal(to(point([10, 10, 10], 0.5), point([0, 0, 0], 1.0)))
    bench.run(20)
    now = bench.position.copy()
    goal = TrajectoryGoal(to(point([5, 5], 0.5), names=("joint1", "joint2")), start_time=bench.time + 0.5)
    handle = bench.controller.send_goal(goal)
    bench.run(50)
    halfway = now + 0.5 * (np.array([5, 5, now[2]]) - now)
    assert bench.position == pytest.approx(halfway, abs=0.3)
    bench.end(handle)
    assert bench.position[:2] == pytest.approx([5, 5])
    assert bench.position[2] == pytest.approx(now[2], abs=0.2)


@pytest.mark.parametrize("joints", [JOINTS, ("joint1",)])
def test_50_a_robot_that_lags(joints):
    """Conformance 50: a smoothing of 0.9 leaves the path tolerance; 0.95 without one misses the goal."""
    n = len(joints)

    def lagging(smoothing, **more):
        bench = Bench(controller(path=0.1, goal=0.01, goal_time=0.05, joints=joints), at=np.zeros(n))
        handle = bench.controller.send_goal(TrajectoryGoal(to(point([1.0] * n, 0.5), names=joints), **more))
        for _ in range(200):
            output = bench.run(1)
            bench.position = smoothing * bench.position + (1.0 - smoothing) * output.command
        return handle

    # At 2 rad/s the lag is 2 x 0.01 x s / (1 - s): 0.02, 0.18, 0.38 rad.
    assert lagging(0.5).status == "succeeded"
    assert lagging(0.9).result.code is ErrorCode.PATH_TOLERANCE_VIOLATED
    free = each((-1.0,) * n, joints, position=1)
    assert lagging(0.95, path_tolerance=free).result.code is ErrorCode.GOAL_TOLERANCE_VIOLATED


LEGAL = [
    ("position",), ("position", "velocity"), ("position", "velocity", "acceleration"), ("velocity",), ("effort",),
    ("position", "effort"),
]  # fmt: skip


@pytest.mark.parametrize("interfaces", LEGAL)
def test_64_legal_interfaces(interfaces):
    """Conformance 64: each set is claimed as it is said, one row of commands each, and a goal is reached on it."""
    made = controller(*interfaces, gains={joint: GainsSpec(p=1.0, ff_velocity_scale=1.0) for joint in JOINTS})
    assert made.interfaces == interfaces
    assert made.output.rows.shape == (3 + len(interfaces), 3)
    bench = Bench(made, ideal=interfaces[0] == "position")
    goal = to(point(START + 1, 1.0, velocities=[0, 0, 0], accelerations=[0, 0, 0]))
    handle = made.send_goal(goal)
    output = bench.run(26)
    p, v, a = 0.103515625, 1.0546875, 5.625  # the quintic at a quarter
    assert output.position == pytest.approx(START + p)
    now = JointTrajectory(JOINTS, goal_points(goal), TrajectoryPoint(START)).sample(0.26)
    for interface, row in zip(interfaces, output.commands, strict=True):
        if interface == "effort" and len(interfaces) == 2:
            assert not row.any()
        elif interfaces in (("velocity",), ("effort",)):
            assert row == pytest.approx(p + now[1])  # the joints are frozen: P times the way, and the velocity ahead
        else:
            assert row == pytest.approx(now[("position", "velocity", "acceleration").index(interface)])
    assert output.velocity == pytest.approx(np.full(3, v))
    assert output.acceleration == pytest.approx(np.full(3, a))
    if bench.ideal:
        bench.end(handle)
        assert handle.status == "succeeded"


def goal_points(goal):
    last = len(goal.times) - 1
    return [TrajectoryPoint(goal.positions[last], goal.times[last], goal.velocities[last], goal.accelerations[last])]


@pytest.mark.parametrize(
    ("commands", "states"),
    [
        ((), ("position", "velocity")),
        (("bad_name",), ("position", "velocity")),
        (("effort", "velocity"), ("position", "velocity")),
        (("effort", "acceleration"), ("position", "velocity")),
        (("velocity", "acceleration"), ("position", "velocity")),
        (("position", "acceleration"), ("position", "velocity")),
        (("acceleration",), ("position", "velocity")),
        (("position", "position"), ("position", "velocity")),
        (("position",), ()),
        (("position",), ("effort",)),
        (("position",), ("velocity",)),
        (("position",), ("velocity", "acceleration")),
        (("position",), ("acceleration",)),
        (("velocity",), ("position",)),
        (("effort",), ("position",)),
        (("position", "effort"), ("position",)),
    ],
)
def test_64_interfaces_that_are_refused(commands, states):
    """Conformance 64: the text names the interfaces."""
    with pytest.raises(InvalidArgument, match="interface") as refused:
        controller(*commands, state_interfaces=states) if commands else JointTrajectoryController(
            name="arm", joints=JOINTS, command_interfaces=()
        )
    assert refused.value.findings[0].code == "CTRL107"


@pytest.mark.parametrize(
    ("keys", "places"),
    [
        ({"command_interfaces": ["effort", "velocity"]}, ["command_interfaces"]),
        ({"command_interface": "acceleration"}, ["command_interface"]),
        ({"command_interfaces": ["position", "velocity"], "command_interface": "position"}, ["command_interfaces"]),
        ({"command_interface": "velocity", "state_interfaces": ["position"]}, ["state_interfaces"]),
        ({"command_interface": "position", "state_interfaces": ["effort"]}, ["state_interfaces"]),
        ({"command_interface": "position", "state_interfaces": ["speed"]}, ["state_interfaces"]),
        ({"command_interfaces": ["position", "effort"], "gravity_compensation": True}, []),
        ({"command_interfaces": ["position"], "inverse_dynamics": True}, ["inverse_dynamics"]),
        ({}, []),
    ],
)
def test_64_a_file_is_told_where_its_interfaces_are_wrong(keys, places):
    """Conformance 64: the same rules, at the place of the key; `command_interface` is short for a list of one."""
    spec = JointTrajectorySpec.model_validate(
        {"type": "joint_trajectory", "joints": JOINTS, "gains": {joint: {"p": 1} for joint in JOINTS}, **keys}
    )
    problems = list(check(spec, SimpleNamespace(joints=())))
    assert [problem.loc[0] for problem in problems] == places
    short = JointTrajectorySpec.model_validate({"type": "joint_trajectory", "joints": JOINTS})
    assert short.interfaces == ("effort",)
