"""Joint trajectory controller: its goals, and its update at each tick.

`controllers/joint_trajectory.py` has the control laws.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from manipcli.control.action import ErrorCode, Feedback, GoalHandle, refuse_inactive
from manipcli.control.active_goal import ActiveGoal, Then, Tolerances
from manipcli.control.active_trajectory import POSITION, VELOCITY, ActiveTrajectory, Reference
from manipcli.control.controller import ControllerOutput, FeedForward, JointState, distinct, refuse_not_finite
from manipcli.control.gains import build_pid, joint_gains, tune_pid
from manipcli.control.jog import Jogging, JogTarget
from manipcli.control.speed_scaling import SpeedScaling
from manipcli.control.stopping import Stopping, StopPlanner
from manipcli.control.tracking_error import TrackingError
from manipcli.control.trajectory_goal import (
    Acceptance,
    JointFacts,
    TrajectoryGoal,
    check_goal,
    controlled_by_error,
    outside_limits,
    refused,
)
from manipcli.control.transitions import Transitions
from manipcli.control.tunable_gains import TunableGains
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.elements import JointLimits, JointType
from manipcli.description.transmission import Compat
from manipcli.plan.trajectory import Interpolation, JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, Interface, Role


class JointTrajectoryController:
    """Executes one goal at a time, and holds in between.

    Activation (the first update) holds the measured position. A goal begins at the first update after `send_goal`, or
    at its start time, from the reference (so that the command makes no step), and is sampled once for every tick of
    that update's period. Until then, and for joints that it leaves out, the previous trajectory is followed. It
    succeeds at or after its end, when all joints are inside their goal tolerances at the same tick; it is aborted when
    a joint exceeds its path tolerance before (also at its first tick), or is outside its goal tolerance `goal_time`
    after the end. After a success the last position is held at rest; after a cancel the reference is brought to rest
    and held: all joints on their straight path, or each by itself if a position limit is near. After an abort the stop
    begins at the measured position, from the measured velocity.

    Where ROS 1 and 2 differ, `compat` chooses; without it the safer rule applies:

        ==========================  =======================  ======================  ========================
        what                        None                     ros1                    ros2
        ==========================  =======================  ======================  ========================
        integral of the PID         acts one step late       acts at once            acts one step late
        a stop                      within acceleration,     constant deceleration   constant deceleration
                                    jerk limits
        after an abort              stop from measured       trajectory continues    hold measured position
                                    motion
        goal_time: 0                no grace                 no grace                unlimited
        a preempted goal            aborted, INVALID_GOAL    canceled                aborted, INVALID_GOAL
        ==========================  =======================  ======================  ========================

    Args:
        name: of the controller.
        joints: (n) distinct names.
        command_interfaces: of the command, one row each: [position], [position, velocity], [position, velocity,
            acceleration], [velocity], [effort] or [position, effort]; a single interface needs no list.
        state_interfaces: measured values: [position], and velocity, and acceleration; as the commands need.
        gains: by joint name, a `GainsSpec` or its fields; needed for [effort] and [velocity].
        constraints: tolerances; absent ones, and a `stopped_velocity_tolerance` of 0, are not enforced.
        limits: (n) of the joints; waypoints beyond them are rejected.
        types: (n) joint types: a `continuous` joint takes the shortest rotation, and its error is the shortest angle.
        feed_forward: added to the effort by the manager.
        compat: see above.
        allow_partial_joints_goal: accept goals that leave joints out.
        allow_nonzero_velocity_at_trajectory_end: accept goals that do not end at rest; their last position is held.
        allow_integration_in_goal_trajectories: accept points with only velocities or accelerations.
        allow_trajectory_replacement: a new goal continues from the previous trajectory; otherwise that ends at once.
        interpolation_method: `splines`, or `none` to step to the next point.
        interpolate_from_desired_state: goals start from the reference; otherwise from the measured state.
        cmd_timeout: [s] after its end, when a goal that is not reached is aborted, and its last position held; 0:
            never. Only effective above goal_time.
        stop_trajectory_duration: [s] of the stop after a cancel; 0: by deceleration.
        speed_scaling: initial trajectory seconds per second.
        positions_upsampling: points with only positions get the velocities of a spline.
        stop_planner: plans stops without `compat`; None: they have a constant deceleration. See `stopping.py`.
        chained_to: the controller whose references it commands; None: it commands the joints.

    Attributes:
        notes: arguments that have no effect, and why.
        scaling: speed of its trajectories, and pauses.
        gains: of its PID, which may change; None without one.

    Raises:
        InvalidArgument: no or duplicate joints, incompatible interfaces, gains of an unknown joint, gains all zero
            where they are needed, a negative time or speed.
    """

    role: Role = "follower"
    senses_contact = False
    sensors = ()

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        command_interfaces: Sequence[Interface] | Interface = ("effort",),
        state_interfaces: Sequence[str] = ("position", "velocity"),
        gains: Mapping[str, GainsSpec | Mapping[str, float]] | None = None,
        constraints: ConstraintsSpec | None = None,
        limits: Sequence[JointLimits] | None = None,
        types: Sequence[JointType] | None = None,
        feed_forward: FeedForward = "none",
        compat: Compat | None = None,
        allow_partial_joints_goal: bool = False,
        allow_nonzero_velocity_at_trajectory_end: bool = False,
        allow_integration_in_goal_trajectories: bool = False,
        allow_trajectory_replacement: bool = True,
        interpolation_method: Interpolation = "splines",
        interpolate_from_desired_state: bool = True,
        cmd_timeout: float = 0.0,
        stop_trajectory_duration: float = 0.0,
        speed_scaling: float = 1.0,
        positions_upsampling: bool = False,
        stop_planner: StopPlanner | None = None,
        chained_to: str | None = None,
    ) -> None:
        self.name, self.chained_to = name, chained_to
        self.joints = distinct(name, joints)
        if isinstance(command_interfaces, str):
            command_interfaces = (command_interfaces,)
        self.interfaces: tuple[Interface, ...] = tuple(command_interfaces)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        if (wrong := refused(command_interfaces, state_interfaces)) is not None:
            raise InvalidArgument("CTRL107", f"controller '{name}': {wrong[0]}", hint=wrong[1])
        for what, value in (
            ("cmd_timeout", cmd_timeout), ("stop_trajectory_duration", stop_trajectory_duration),
            ("speed_scaling", speed_scaling),
        ):  # fmt: skip
            if not 0.0 <= value < np.inf:
                raise InvalidArgument("CTRL108", f"controller '{name}': {what} is {value}; expected 0 or more")
        self._compat = compat
        self.accepts_goals = True
        self._facts = JointFacts.of(self.joints, limits, types)
        self._constraints = constraints if constraints is not None else ConstraintsSpec()
        self._accepted = Acceptance(
            allow_partial_joints_goal, allow_nonzero_velocity_at_trajectory_end,
            allow_integration_in_goal_trajectories, efforts="effort" in self.interfaces,
        )  # fmt: skip
        self._transitions = Transitions(
            facts=self._facts, replaces=allow_trajectory_replacement, from_desired=interpolate_from_desired_state,
            smooth=positions_upsampling, interpolation=interpolation_method,
        )  # fmt: skip
        planner = stop_planner if compat is None else None
        self._jogging = Jogging(self._facts, limits)
        self._stopping = Stopping.of(self._facts, self._constraints, stop_trajectory_duration, planner)
        self._default_tolerances = Tolerances.of(self.joints, self._constraints, patient=compat == "ros2")
        self.notes: tuple[str, ...] = ()
        self._timeout = cmd_timeout if cmd_timeout > self._constraints.goal_time else np.inf
        if 0.0 < cmd_timeout <= self._constraints.goal_time:
            self.notes = (f"cmd_timeout {cmd_timeout:g} s has no effect: it is not above goal_time",)
        by_error = controlled_by_error(self.interfaces)
        chosen = joint_gains(name, self.joints, gains or {})
        self._pid = build_pid(name, self.joints, chosen, compat) if by_error else None
        self.gains = TunableGains(name, self.joints, chosen, self._tune) if by_error else None
        scale = np.array([gain.ff_velocity_scale for gain in chosen])
        self.output = ControllerOutput.of(n, len(self.interfaces))
        rows = self.output.rows
        self._reference = Reference(
            rows[:3], self.interfaces, velocity_scale=scale if by_error else None, acceleration=self._facts.acceleration
        )
        self._desired, self._desired_velocity, self._commands = rows[0], rows[1], rows[3:]
        self._tracking = TrackingError(rows[:2], self._facts)
        self._errors = self._tracking.errors
        self._error, self._error_rate = self._errors
        pid, feed = self._pid, self._reference.feed_room[0]
        self._control = None if pid is None else pid.loop(self._errors, rows[3], feed=feed)
        self.scaling = SpeedScaling(self._reference, speed_scaling, now=lambda: self._time, ask=self._ask)
        self._clear(time=0.0)

    def _clear(self, *, time: float) -> None:
        self._activated, self._waiting = False, True
        self._time, self._period = time, 0.0
        self._goal: ActiveGoal | None = None
        self._next: ActiveGoal | None = None
        self._jogging.end()
        self._stop = False
        self._bound = np.inf
        self.scaling.reset()
        self._scaled = True

    @property
    def tolerances(self) -> Tolerances:
        """The tolerances of the goal, waiting or active, otherwise of the controller."""
        goal = self._next or self._goal
        return self._default_tolerances if goal is None else goal.tolerances

    def _tune(self, gains: tuple[GainsSpec, ...]) -> None:
        tune_pid(self._pid, self.name, self.joints, gains)
        self._reference.scale_feed(np.array([gain.ff_velocity_scale for gain in gains]))

    def send_goal(
        self, trajectory: JointTrajectory | TrajectoryGoal, *, constraints: ConstraintsSpec | None = None
    ) -> GoalHandle:
        """Accept a trajectory, with its joints in any order; the previous goal ends.

        Args:
            trajectory: starts at the next update; a `TrajectoryGoal` may set another time, and tolerances.
            constraints: for this goal, instead of the controller's.

        Raises:
            GoalRejected: the controller is inactive; unknown or missing joints, waypoints beyond position limits,
                velocities above the limits (also on the path to the next point, once it is active), points with
                forbidden fields, a velocity at the end, an end in the past. The previous goal then continues.
        """
        refuse_inactive(self.name, self.accepts_goals)
        goal = trajectory if isinstance(trajectory, TrajectoryGoal) else TrajectoryGoal(trajectory)
        ordered = check_goal(goal, self._facts, self._accepted, self._time)
        if self._activated:
            actual = self._desired - self._error
            self._transitions.check_way(ordered, goal.start_time, self._reference, self._time, self._period, actual)
        tolerances = self._default_tolerances
        if constraints is not None:
            tolerances = Tolerances.of(self.joints, constraints, patient=self._compat == "ros2")
        tolerances, notes = tolerances.adopted(goal, self.joints)
        self._preempt("a new goal")
        ends = zip(self.joints, np.isfinite(tolerances.goal[0]).tolist(), strict=True)
        bounded = frozenset(joint for joint, finite in ends if finite)
        handle = GoalHandle(cancel=self._cancel, feedback=self._feedback, notes=notes, bounded=bounded)
        self._next = ActiveGoal(
            self.name, self._facts, handle, ordered, tolerances, goal.start_time, self._timeout,
            unchecked=not self._activated,
        )  # fmt: skip
        self._waiting = True
        return handle

    def _preempt(self, by: str) -> None:
        for old in filter(None, (self._goal, self._next)):
            old.preempt(self._time, as_canceled=self._compat == "ros1", by=by)
        self._goal = self._next = None

    def jog(self, target: JogTarget, *, until: float) -> None:
        """Follow the velocities of `target` until the time `until` [s], then stop; see `jog.py`. A goal ends it.

        Raises:
            GoalRejected: the controller is inactive.
        """
        refuse_inactive(self.name, self.accepts_goals)
        self._preempt("jogging")
        self._bound, self._stop = np.inf, False
        self._jogging.begin(target, until)

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
        for goal in filter(None, (self._goal, self._next)):
            goal.handle.end("aborted", ErrorCode.INVALID_GOAL, reason, time)
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

        Raises:
            InvalidArgument: a period that is not above 0; a measured position or velocity that is not finite.
        """
        if not 0.0 < period < math.inf:
            raise InvalidArgument("CTRL105", f"controller '{self.name}': a period of {period} s; expected more than 0")
        self._time, self._period = time, period
        reference = self._reference
        if reference.moving:
            reference.advance(time, period)
        if self._waiting:
            self._handle_requests(time, period, measured)
        if self._jogging.active:
            self._jogging.step(reference, time, period, min(self.scaling.wanted, 1.0))
        if self._scaled:
            self._report_speed(time)
        if not self._tracking.update(measured, self._bound):
            self._look_closer(time, measured)
        if reference.ended and self._goal is not None:
            late = reference.clock(time) - reference.end
            then = self._goal.judge_end(self._errors, self.output.acceleration, measured.velocity, time, late)
            self._go_on(then, time, measured)
        if self._control is None:
            self._commands[:] = reference.feed_room
        else:
            self._control(period, reference.feeds)
        return self.output

    def _look_closer(self, time: float, measured: JointState) -> None:
        """Abort the goal if a joint exceeds its path tolerance."""
        refuse_not_finite(self.name, self.joints, measured, time)
        goal, reference = self._goal, self._reference
        if goal is None:
            return
        clock = reference.clock(time)
        if not reference.ended or clock <= 0.0:
            then = goal.judge_path(self._errors, self.output.acceleration, measured.velocity, time, clock)
            self._go_on(then, time, measured)

    def _go_on(self, then: Then, time: float, measured: JointState) -> None:
        if then == "go on":
            return
        self._forget()
        if then == "hold measured" and self._compat != "ros1":
            row = ActiveTrajectory.hold(measured.position).rest
            if self._compat is None:
                row[VELOCITY] = measured.velocity
            self._come_to_rest(row, time, self._period)
            self._tracking.update(measured, self._bound)

    def _forget(self) -> None:
        self._goal, self._bound = None, np.inf

    def _handle_requests(self, time: float, period: float, measured: JointState) -> None:
        """Carry out the requests since the last update: activation, a new goal, a stop."""
        self._waiting = False
        if not self._activated:
            self._activated = True
            if self._pid is not None:
                self._pid.reset()
            self._reference.hold(ActiveTrajectory.hold(measured.position), time=time)
        if (self._next is not None or self._stop) and (row := self._jogging.end()) is not None:
            self._come_to_rest(row, time, period)
        if self._next is not None:
            self._begin(self._next, time, period, measured)
        elif self._stop:
            self._come_to_rest(self._reference.row(time), time, period)
        self._next, self._stop = None, False
        self.scaling.approach(time, period)

    def _ask(self) -> None:
        self._waiting = self._scaled = True

    def _report_speed(self, time: float) -> None:
        self.output.speed[0] = speed = self.scaling.pace(time)[0]
        self._scaled = not speed == self.scaling.wanted == 1.0

    def _begin(self, goal: ActiveGoal, time: float, period: float, measured: JointState) -> None:
        """Make the waiting goal active, and sample its references for every tick."""
        reference = self._reference
        later = goal.start_time - time if goal.start_time > 0.0 else 0.0
        if goal.unchecked and not goal.reachable(self._transitions, reference, time, period, measured.position):
            return
        speed, at = self.scaling.begin(time), (measured.position, measured.velocity)
        active = self._transitions.to_goal(goal.trajectory, later, reference, time, speed, at)
        samples = active.ticks(period)
        broken = outside_limits(samples[:, POSITION], self._facts, period)
        if broken is not None:
            goal.handle.end("aborted", ErrorCode.INVALID_GOAL, f"controller '{self.name}': {broken}", time)
            self._come_to_rest(self._reference.row(time), time, period)
            return
        goal.begin = later
        self._goal = goal
        self._bound = goal.tolerances.bound
        reference.follow(active, samples, time=time, period=period, speed=speed[0])
        reference.advance(time, period)

    def _come_to_rest(self, row: Array, time: float, period: float) -> None:
        active = self._stopping.to_rest(row, period)
        if active.parts:
            self._reference.follow(active, active.ticks(period), time=time, period=period)
            self._reference.advance(time, period)
        else:
            self._reference.hold(active, time=time)

    def _cancel(self, handle: GoalHandle) -> None:
        handle.end("canceled", ErrorCode.SUCCESSFUL, f"canceled at t = {self._time:.3f} s", self._time)
        if self._next is not None and self._next.handle is handle:
            self._next = None  # the previous goal ended when this one was sent: its trajectory is dropped, too
        else:
            self._forget()
        self._stop = self._waiting = True

    def _feedback(self) -> Feedback:
        goal, clock = self._goal, self._reference.clock(self._time)
        return Feedback(
            elapsed=clock if goal is None else clock - goal.begin,
            desired=self._desired.copy(),
            actual=self._desired - self._error,
            index=0 if goal is None else goal.next_point(clock),
            desired_velocity=self._desired_velocity.copy(),
            actual_velocity=self._desired_velocity - self._error_rate,
        )
