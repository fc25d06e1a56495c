"""Follows joint trajectories on an effort, velocity or position interface, with tolerances that name what broke them.

    controllers:
      arm_controller:
        type: joint_trajectory
        joints: [joint_1, joint_2]
        command_interface: effort
        gains: {joint_1: {p: 800, d: 50}, joint_2: {p: 400, d: 25}}
        gravity_compensation: true
        constraints: {goal_time: 2 s, joints: {joint_1: {trajectory: 0.1, goal: 0.02}}}

Effort: u = PID(e, de/dt) + feed-forward. Velocity: u = v ff_velocity_scale + PID. Position: u = the reference.
The error, and so every tolerance, is reference(t) - measured(t); velocity and position commands look one period ahead,
because they are what the joint shall have when the next tick measures it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from manipcli.control.action import ErrorCode, Feedback, GoalHandle
from manipcli.control.controller import ControllerMember, ControllerOutput, FeedForward, Fit, JointState
from manipcli.control.gains import build_pid, idle_gains, joint_gains, strangers
from manipcli.control.pid import Compat
from manipcli.control.tolerances import Tolerances
from manipcli.control.trajectory_goal import JointFacts, check_goal, lead_in, outside_limits, stopping
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.model.condition import Problem
from manipcli.model.robot import JointLimits, JointType, RobotModel
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, Interface, JointTrajectorySpec, Role

POSITION, VELOCITY, ACCELERATION = 0, 1, 2  # the rows of a reference (3, n)


class JointTrajectoryController:
    """One goal at a time; holds in between.

    Activation (the first update) holds the measured position. A goal begins at the first update after `send_goal`, from
    the reference (not the measured position, so that the command makes no step), and is sampled once for every tick of
    that update's period. It succeeds at or after its end, when all joints are inside their goal tolerances at the same
    tick; it is aborted when a joint leaves its path tolerance before, or is outside its goal tolerance `goal_time`
    after the end (0: at the end). After an abort the controller holds the measured position at rest; after a cancel it
    stops the reference within the acceleration limits, where those are known, and holds there; after a success it
    holds the last point at rest. A new goal aborts the one before.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        interface: what the command is.
        gains: by joint name; needed for effort and velocity.
        constraints: tolerances; those of `stopped_velocity_tolerance` 0 and absent ones are not enforced.
        limits: (n) of the joints; waypoints beyond them are refused.
        types: (n) joint types: a `continuous` joint takes the shortest way and its error is the shortest angle.
        feed_forward: what the caller of `update` shall pass for this controller.
        allow_end_velocity: accept trajectories that do not end at rest.
        compat: order of the PID integration.

    Raises:
        InvalidArgument: no or repeated joints, gains of an unknown joint, gains all zero where they are needed.
    """

    role: Role = "follower"
    senses_contact = False

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        interface: Interface = "effort",
        gains: Mapping[str, GainsSpec] | None = None,
        constraints: ConstraintsSpec | None = None,
        limits: Sequence[JointLimits] | None = None,
        types: Sequence[JointType] | None = None,
        feed_forward: FeedForward = "none",
        allow_end_velocity: bool = False,
        compat: Compat = "ros2",
    ) -> None:
        self.name = name
        self.joints = tuple(joints)
        self.interfaces: tuple[Interface, ...] = (interface,)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        if n == 0 or len(set(self.joints)) != n:
            raise InvalidArgument("CTRL101", f"controller '{name}': its joints must be distinct, and at least one")
        self._facts = JointFacts.of(self.joints, limits, types)
        self._allow_end_velocity = allow_end_velocity
        self._constraints = constraints if constraints is not None else ConstraintsSpec()
        self._default_tolerances = Tolerances.of(self.joints, self._constraints)
        chosen = joint_gains(name, self.joints, gains or {})
        self._pid = None if interface == "position" else build_pid(name, self.joints, chosen, compat)
        self._velocity_scale = np.array([each.ff_velocity_scale for each in chosen])

        self._output = ControllerOutput.of(n, 1)
        self._buffer = self._output.rows[:3]
        self._command = self._output.command
        self._measured = np.zeros(n)
        self._error, self._error_rate = np.zeros((2, n))
        self._activated = False
        self._clear(time=0.0)

    def _clear(self, *, time: float) -> None:
        self._table = np.zeros((1, 3, len(self.joints)))
        self._last_row = 0
        self._began = self._time = time
        self._dt = math.inf
        self._goal: GoalHandle | None = None
        self._next: tuple[GoalHandle, JointTrajectory, Tolerances] | None = None
        self._stop = False
        self._tolerances = self._default_tolerances
        self._end_row, self._end_time = 0, 0.0

    def send_goal(self, trajectory: JointTrajectory, *, constraints: ConstraintsSpec | None = None) -> GoalHandle:
        """Accepts a trajectory, whose joints may stand in another order; a goal before it ends as aborted.

        Args:
            trajectory: starts at the next update.
            constraints: for this goal, instead of the controller's.

        Raises:
            InvalidArgument: unknown or missing joints, waypoints beyond position limits, velocities over the limits,
                points that differ in what they give, a velocity at the end. The goal before then goes on.
        """
        ordered = check_goal(trajectory, self._facts, allow_end_velocity=self._allow_end_velocity)
        tolerances = self._default_tolerances if constraints is None else Tolerances.of(self.joints, constraints)
        for old in (self._goal, self._next[0] if self._next is not None else None):
            if old is not None:
                old.end("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", self._time)
        self._goal = None
        handle = GoalHandle(cancel=self._cancel, feedback=self._feedback)
        self._next = (handle, ordered, tolerances)
        return handle

    @property
    def output(self) -> ControllerOutput:
        """What the last update wrote."""
        return self._output

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Ends its goal as aborted and forgets its state; the next update activates it again."""
        for goal in (self._goal, self._next[0] if self._next is not None else None):
            if goal is not None:
                goal.end("aborted", ErrorCode.INVALID_GOAL, reason, time)
        self._activated = False
        self._clear(time=time)

    def update(
        self,
        time: float,
        period: float,
        measured: JointState,
        *,
        contact_force: Array | None = None,
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s]; see the module for the laws.

        Args:
            measured: (n) of the controller's joints.
            contact_force: ignored.
        """
        self._time = time
        position = measured.position
        self._measured[:] = position
        if not self._activated:
            self._activated = True
            if self._pid is not None:
                self._pid.reset()
            self._hold(time, position)
        if self._next is not None:
            self._begin(time, period)
        elif self._stop:
            self._begin_stop(time, period)
        row = int((time - self._began) / self._dt + 0.5)
        ahead = row + 1
        if row > self._last_row:
            row = ahead = self._last_row
        elif ahead > self._last_row:
            ahead = self._last_row
        elif row < 0:  # the clock was set back
            row = ahead = 0
        self._compare(row, position, measured.velocity)
        if self._goal is not None and self._judge(row, time):
            self._hold(time, position)
            self._compare(0, position, measured.velocity)
        if ahead > self._last_row:  # the goal has just ended, and a table of one row holds
            ahead = 0

        if self._pid is None:
            self._command[:] = self._table[ahead, POSITION]
            return self._output
        command = self._pid.update(self._error, period, self._error_rate)
        if self.interfaces[0] == "velocity":
            command += self._velocity_scale * self._table[ahead, VELOCITY]
        self._command[:] = command
        return self._output

    def _compare(self, row: int, position: Array, velocity: Array) -> None:
        """Writes reference and errors of this tick."""
        self._buffer[:] = self._table[row]
        np.subtract(self._output.position, position, out=self._error)
        if self._facts.wraps:
            turns = np.ceil(np.abs(self._error) / math.tau - 0.5)
            self._error -= self._facts.continuous * math.tau * np.copysign(np.maximum(turns, 0.0), self._error)
        np.subtract(self._output.velocity, velocity, out=self._error_rate)

    def _judge(self, row: int, time: float) -> bool:
        """Ends the goal where it is due; True when it was aborted."""
        goal, tolerances = self._goal, self._tolerances
        assert goal is not None
        if row < self._end_row or row == 0:
            if tolerances.outside_path(self._error):
                text = tolerances.path_text(self._facts, self._error, time, time - self._began)
                return self._abort(goal, ErrorCode.PATH_TOLERANCE_VIOLATED, text, time)
            if row < self._end_row:
                return False
        if tolerances.inside_goal(self._error, self._error_rate):
            goal.end("succeeded", ErrorCode.SUCCESSFUL, f"goal reached at t = {time:.3f} s", time)
            self._goal = None
            self._hold(time, self._table[-1, POSITION])
            return False
        late = time - self._began - self._end_time
        if late > tolerances.goal_time:
            text = tolerances.goal_text(self._facts, self._error, self._error_rate, time, late)
            return self._abort(goal, ErrorCode.GOAL_TOLERANCE_VIOLATED, text, time)
        return False

    def _abort(self, goal: GoalHandle, code: ErrorCode, text: str, time: float) -> bool:
        goal.end("aborted", code, f"controller '{self.name}': {text}", time)
        self._goal = None
        return True

    def _follow(self, table: Array, time: float, period: float, end_time: float) -> None:
        """`table` (T, 3, n) holds the references of the ticks from `time` on; its last row stays."""
        self._table, self._last_row = table, len(table) - 1
        self._began, self._dt = time, period
        self._end_time = end_time
        self._end_row = math.ceil(end_time / period - 1e-6)

    def _hold(self, time: float, position: Array) -> None:
        table = np.zeros((1, 3, len(self.joints)))
        table[0, POSITION] = position
        self._follow(table, time, math.inf, 0.0)

    def _begin(self, time: float, period: float) -> None:
        """The waiting goal becomes the active one: its references for every tick, once."""
        assert self._next is not None
        if not period > 0.0:
            raise InvalidArgument("CTRL105", f"controller '{self.name}': a period of {period} s; expected more than 0")
        handle, trajectory, tolerances = self._next
        self._next, self._stop = None, False
        reference = self._reference(time)
        whole = lead_in(trajectory, reference, self._facts)
        count = math.ceil(whole.duration / period - 1e-6)
        # A last row at rest: what the controller holds once the trajectory is over.
        table = np.zeros((count + 2, 3, len(self.joints)))
        ticks = np.arange(count + 1) * period
        on_tick = ticks[-1] - whole.duration
        if abs(on_tick) < 1e-6 * period:
            ticks[-1] = whole.duration
        table[:-1, POSITION], table[:-1, VELOCITY], table[:-1, ACCELERATION] = whole.sample(ticks)
        table[-1, POSITION] = whole.positions[-1]
        broken = outside_limits(table[:, POSITION], self._facts, period)
        if broken is not None:
            handle.end("aborted", ErrorCode.INVALID_GOAL, f"controller '{self.name}': {broken}", time)
            hold = np.array(reference[POSITION])
            self._hold(time, hold)
            return
        self._goal, self._tolerances = handle, tolerances
        self._follow(table, time, period, whole.duration)

    def _reference(self, time: float) -> Array:
        row = max(0, min(int((time - self._began) / self._dt + 0.5), self._last_row))
        return np.asarray(self._table[row])

    def _begin_stop(self, time: float, period: float) -> None:
        self._stop = False
        self._follow(stopping(self._reference(time), self._facts.acceleration, period), time, period, 0.0)

    def _cancel(self, handle: GoalHandle) -> None:
        handle.end("canceled", ErrorCode.SUCCESSFUL, f"canceled at t = {self._time:.3f} s", self._time)
        if self._next is not None and self._next[0] is handle:
            self._next = None
        if self._goal is handle:
            self._goal = None
            self._stop = True

    def _feedback(self) -> Feedback:
        return Feedback(
            elapsed=self._time - self._began,
            desired=self._output.position.copy(),
            actual=self._measured.copy(),
        )


def build(name: str, spec: JointTrajectorySpec, fit: Fit) -> JointTrajectoryController:
    """The controller of a spec."""
    joints = [fit.robot.joint(joint) for joint in spec.joints]
    wants: FeedForward = "gravity" if spec.gravity_compensation else "none"
    return JointTrajectoryController(
        name=name,
        joints=spec.joints,
        interface=spec.interfaces[0],
        gains=spec.gains,
        constraints=spec.constraints,
        limits=[joint.limits for joint in joints],
        types=[joint.type for joint in joints],
        feed_forward="inverse_dynamics" if spec.inverse_dynamics else wants,
        compat=fit.compat,
    )


def check(spec: JointTrajectorySpec, robot: RobotModel) -> Iterator[Problem]:
    """Gains and tolerances of joints that it does not have, gains all zero, an effort added where there is none."""
    yield from strangers(spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    yield from strangers(spec.joints, spec.constraints.joints, ("constraints", "joints"), "tolerances", "CTRL104")
    if spec.interfaces[0] == "effort":
        yield from idle_gains(spec.joints, spec.gains, "effort")
        return
    if spec.interfaces[0] == "velocity":
        yield from idle_gains(spec.joints, spec.gains, "velocity")
    for key in ("gravity_compensation", "inverse_dynamics"):
        if getattr(spec, key):
            message = f"{key} adds an effort, but its interface is {spec.interfaces[0]}"
            yield Problem((key,), message, "use command_interface: effort, or leave it out", "CTRL147")


MEMBER = ControllerMember(name="joint_trajectory", spec=JointTrajectorySpec, build=build, check=check)
