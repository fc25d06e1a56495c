"""Follows joint trajectories on position, velocity and effort interfaces, with tolerances that name what broke them.

    controllers:
      arm_controller:
        type: joint_trajectory
        joints: [joint_1, joint_2]
        command_interfaces: [effort]
        gains: {joint_1: {p: 800, d: 50}, joint_2: {p: 400, d: 25}}
        gravity_compensation: true
        constraints: {goal_time: 2 s, joints: {joint_1: {trajectory: 0.1, goal: 0.02}}}

With the reference q, v, a at t, at t + period marked by ', and the effort tau of the goal's points:

    [effort]              u = PID(e, de/dt) + ff_velocity_scale v' + tau'
    [velocity]            u = PID(e, de/dt) + ff_velocity_scale v'
    [position], [position, velocity], [position, velocity, acceleration]: q', v', a'
    [position, effort]    q', tau'

The error, and so every tolerance, is reference(t) - measured(t); what is fed forward looks one period ahead, because it
is what the joint shall have when the next tick measures it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.control.action import ErrorCode, Feedback, GoalHandle
from manipcli.control.controller import ControllerMember, ControllerOutput, FeedForward, Fit, JointState
from manipcli.control.course import (
    ACCELERATION,
    EFFORT,
    POSITION,
    VELOCITY,
    Columns,
    Course,
    Part,
    decelerating,
    stopping_in,
)
from manipcli.control.gains import build_pid, idle_gains, joint_gains, strangers
from manipcli.control.pid import Compat
from manipcli.control.reference import Feeds, Reference
from manipcli.control.tolerances import Tolerances
from manipcli.control.trajectory_goal import (
    Acceptance,
    JointFacts,
    TrajectoryGoal,
    check_goal,
    lead_in,
    outside_limits,
    shortest,
)
from manipcli.control.trajectory_interfaces import controlled_by_error, refused
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.model.condition import Problem
from manipcli.model.robot import JointLimits, JointType, RobotModel
from manipcli.plan.trajectory import Interpolation, JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, Interface, JointTrajectorySpec, Role


@dataclass(frozen=True, slots=True, eq=False)
class _Goal:
    """A goal that was accepted: its trajectory in the order of the controller's joints, and its tolerances.

    `begin` [s] in the clock of the course, once it is followed.
    """

    handle: GoalHandle
    trajectory: JointTrajectory
    tolerances: Tolerances
    start_time: float
    begin: float = 0.0


class JointTrajectoryController:
    """One goal at a time; holds in between.

    Activation (the first update) holds the measured position. A goal begins at the first update after `send_goal`, or
    at its start time, from the reference (so that the command makes no step), and is sampled once for every tick of
    that update's period. Until then, and for joints that it leaves out, the path before is followed. It succeeds at or
    after its end, when all joints are inside their goal tolerances at the same tick; it is aborted when a joint leaves
    its path tolerance before (and at its first tick), or is outside its goal tolerance `goal_time` after the end. After
    a success the last position is held at rest; after a cancel the reference is brought to rest and held.

    Where ROS 1 and 2 differ, `compat` chooses; without it the safer of the two is done:

        ==========================  =======================  ======================  ========================
        what                        None                     ros1                    ros2
        ==========================  =======================  ======================  ========================
        integral of the PID         acts one step late       acts at once            acts one step late
        after an abort              holds what is measured   the trajectory goes on  holds what is measured
        goal_time: 0                no grace                 no grace                waits without end
        a goal that is preempted    aborted, INVALID_GOAL    canceled                aborted, INVALID_GOAL
        ==========================  =======================  ======================  ========================

    Args:
        name: of the controller.
        joints: (n) distinct names.
        command_interfaces: what the command is, one row each: [position], [position, velocity], [position, velocity,
            acceleration], [velocity], [effort] or [position, effort].
        state_interfaces: what may be read: [position], and velocity, and acceleration; needed by the commands.
        gains: by joint name; needed for [effort] and [velocity].
        constraints: tolerances; those of `stopped_velocity_tolerance` 0 and absent ones are not enforced.
        limits: (n) of the joints; waypoints beyond them are refused.
        types: (n) joint types: a `continuous` joint takes the shortest way and its error is the shortest angle.
        feed_forward: what the manager shall add to the effort.
        compat: see above.
        allow_partial_joints_goal: accept goals that leave joints out.
        allow_nonzero_velocity_at_trajectory_end: accept goals that do not end at rest; they are held at rest.
        allow_integration_in_goal_trajectories: accept points of velocities or accelerations alone.
        allow_trajectory_replacement: a new goal goes on from the path before; else that ends where the reference is.
        interpolation_method: `splines`, or `none` to step to the next point.
        interpolate_from_desired_state: goals start from the reference; else from what is measured.
        cmd_timeout: [s] after its end a goal that is not reached is aborted, and its last position held; 0: never.
            Only where it is above goal_time.
        stop_trajectory_duration: [s] a cancel stops in this time; 0: by deceleration.
        speed_scaling: seconds of a trajectory a second, at first.
        positions_upsampling: points of positions alone get the velocities of a spline.

    Attributes:
        notes: what of this was not taken as it was said, and why.

    Raises:
        InvalidArgument: no or repeated joints, interfaces that do not go together, gains of an unknown joint, gains all
            zero where they are needed, a negative time or speed.
    """

    role: Role = "follower"
    senses_contact = False

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        command_interfaces: Sequence[Interface] = ("effort",),
        state_interfaces: Sequence[str] = ("position", "velocity"),
        gains: Mapping[str, GainsSpec] | None = None,
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
    ) -> None:
        self.name = name
        self.joints = tuple(joints)
        self.interfaces: tuple[Interface, ...] = tuple(command_interfaces)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        if n == 0 or len(set(self.joints)) != n:
            raise InvalidArgument("CTRL101", f"controller '{name}': its joints must be distinct, and at least one")
        wrong = refused(command_interfaces, state_interfaces)
        if wrong is not None:
            raise InvalidArgument("CTRL107", f"controller '{name}': {wrong[0]}", hint=wrong[1])
        for what, value in (
            ("cmd_timeout", cmd_timeout), ("stop_trajectory_duration", stop_trajectory_duration),
            ("speed_scaling", speed_scaling),
        ):  # fmt: skip
            if not 0.0 <= value < np.inf:
                raise InvalidArgument("CTRL108", f"controller '{name}': {what} is {value}; expected 0 or more")
        self._compat = compat
        self._facts = JointFacts.of(self.joints, limits, types)
        self._constraints = constraints if constraints is not None else ConstraintsSpec()
        self._accepted = Acceptance(
            allow_partial_joints_goal, allow_nonzero_velocity_at_trajectory_end,
            allow_integration_in_goal_trajectories, efforts="effort" in self.interfaces,
        )  # fmt: skip
        self._replaces = allow_trajectory_replacement
        self._interpolation = interpolation_method
        self._from_desired = interpolate_from_desired_state
        self._smooth = positions_upsampling
        self._stop_duration = stop_trajectory_duration
        self._deceleration = self._decelerations()
        self._default_tolerances = Tolerances.of(self.joints, self._constraints, patient=compat == "ros2")
        self.notes: tuple[str, ...] = ()
        self._timeout = cmd_timeout if cmd_timeout > self._constraints.goal_time else np.inf
        if 0.0 < cmd_timeout <= self._constraints.goal_time:
            self.notes = (f"cmd_timeout {cmd_timeout:g} s is not above goal_time and counts for nothing",)

        by_error = controlled_by_error(self.interfaces)
        chosen = joint_gains(name, self.joints, gains or {})
        self._pid = build_pid(name, self.joints, chosen, compat) if by_error else None
        scale = np.array([each.ff_velocity_scale for each in chosen])
        self._output = ControllerOutput.of(n, len(self.interfaces))
        rows = self._output.rows
        self._reference = Reference(rows[:3], Feeds(self.interfaces, velocity_scale=scale if by_error else None))
        self._desired, self._desired_velocity = rows[0], rows[1]
        self._commands, self._command = rows[3:], rows[3]
        self._errors = np.zeros((2, n))
        self._error, self._error_rate = self._errors
        self._all_errors = self._errors.reshape(-1)
        self._wraps = self._facts.wraps
        self._initial_speed = self._speed = speed_scaling
        self._clear(time=0.0)

    def _decelerations(self) -> Array:
        """(n) how fast each joint stops after a cancel; infinite: at once."""
        if not self._constraints.decelerate_on_cancel:
            return np.full(len(self.joints), np.inf)
        own = {joint: one.max_deceleration_on_cancel for joint, one in self._constraints.joints.items()}
        self._stops_together = not any(own.values())
        return np.array([own.get(j, 0.0) or a for j, a in zip(self.joints, self._facts.acceleration, strict=True)])

    def _clear(self, *, time: float) -> None:
        self._activated = False
        self._waiting = True
        self._time = time
        self._goal: _Goal | None = None
        self._next: _Goal | None = None
        self._stop = False
        self._bound = np.inf
        self._before: tuple[float, Array] | None = None
        self._speed = self._initial_speed

    @property
    def output(self) -> ControllerOutput:
        """What the last update wrote."""
        return self._output

    @property
    def tolerances(self) -> Tolerances:
        """Those of the goal, waiting or active, or else of the controller."""
        goal = self._next or self._goal
        return self._default_tolerances if goal is None else goal.tolerances

    @property
    def speed_scaling(self) -> float:
        """Seconds of a trajectory a second."""
        return self._speed

    def set_speed_scaling(self, speed: float) -> bool:
        """From the last update on, trajectories run so fast: 0 pauses, 1 is as they say. Stops are not scaled.

        The reference's velocity is multiplied by `speed`, its acceleration by the square.

        Returns:
            False for a negative speed or none, which changes nothing.
        """
        if not 0.0 <= speed < np.inf:
            return False
        self._speed = float(speed)
        if self._goal is not None:
            self._reference.rescale(self._speed, time=self._time)
        return True

    def send_goal(
        self, trajectory: JointTrajectory | TrajectoryGoal, *, constraints: ConstraintsSpec | None = None
    ) -> GoalHandle:
        """Accepts a trajectory, whose joints may stand in another order; a goal before it ends.

        Args:
            trajectory: starts at the next update; a `TrajectoryGoal` may say another time, and tolerances.
            constraints: for this goal, instead of the controller's.

        Raises:
            GoalRejected: unknown or missing joints, waypoints beyond position limits, velocities over the limits,
                points that differ in what they give or give what is not allowed, a velocity at the end, an end in the
                past. The goal before then goes on.
        """
        goal = trajectory if isinstance(trajectory, TrajectoryGoal) else TrajectoryGoal(trajectory)
        ordered = check_goal(goal, self._facts, self._accepted, self._time)
        tolerances = self._default_tolerances
        if constraints is not None:
            tolerances = Tolerances.of(self.joints, constraints, patient=self._compat == "ros2")
        tolerances, notes = tolerances.adopted(goal, self.joints)
        for old in (self._goal, self._next):
            if old is not None and self._compat == "ros1":
                old.handle.end("canceled", ErrorCode.SUCCESSFUL, "preempted by a new goal", self._time)
            elif old is not None:
                old.handle.end("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", self._time)
        self._goal = None
        handle = GoalHandle(cancel=self._cancel, feedback=self._feedback, notes=notes)
        self._next = _Goal(handle, ordered, tolerances, goal.start_time)
        self._waiting = True
        return handle

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Ends its goal as aborted and forgets its state; the next update activates it again."""
        for goal in (self._goal, self._next):
            if goal is not None:
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
        self._time = time
        reference = self._reference
        if reference.moving:
            reference.advance(time, period)
        if self._waiting:
            self._turn(time, period, measured)
        np.subtract(self._desired, measured.position, self._error)
        np.subtract(self._desired_velocity, measured.velocity, self._error_rate)
        if self._wraps:
            shortest(self._error, self._facts)
        # The largest error is at most their norm: nearly always this alone answers. NaN and infinity do not pass.
        if not self._all_errors.dot(self._all_errors) < self._bound:
            self._look_closer(time, period, measured)
        if reference.ended and self._goal is not None:
            self._arrive(self._goal, time, measured)
        feed = reference.feed
        if self._pid is None:
            self._commands[:] = feed
        else:
            self._pid.apply(self._errors, period, self._command)
            if feed is not None:
                self._command += feed[0]
        return self._output

    def _compare(self, measured: JointState) -> None:
        """Writes the errors of this tick, once more."""
        np.subtract(self._desired, measured.position, out=self._error)
        np.subtract(self._desired_velocity, measured.velocity, out=self._error_rate)
        if self._wraps:
            shortest(self._error, self._facts)

    def _look_closer(self, time: float, period: float, measured: JointState) -> None:
        """Ends the goal where a joint left its path tolerance."""
        for what, values in (("position", measured.position), ("velocity", measured.velocity)):
            if not np.isfinite(values).all():
                j = int(np.flatnonzero(~np.isfinite(values))[0])
                message = f"the measured {what} of joint '{self.joints[j]}' is {values[j]} at t = {time:.3f} s"
                raise InvalidArgument("CTRL106", f"controller '{self.name}': {message}")
        goal, reference = self._goal, self._reference
        if goal is None:
            return
        errors = self._judged(goal, time, measured)
        elapsed = reference.clock(time)
        if (not reference.ended or elapsed <= 0.0) and goal.tolerances.outside_path(errors):
            text = goal.tolerances.path_text(self._facts, errors, time, elapsed - goal.begin)
            self._abort(goal, ErrorCode.PATH_TOLERANCE_VIOLATED, text, time, measured)

    def _judged(self, goal: _Goal, time: float, measured: JointState) -> list[Array]:
        """Errors of position, velocity and, where the goal asks for it and it is known, of acceleration.

        What is measured of that is the change of the velocity since the tick before.
        """
        errors = [self._error, self._error_rate]
        if goal.tolerances.needs_acceleration:
            before, self._before = self._before, (time, np.array(measured.velocity))
            if before is not None and time > before[0]:
                acceleration = (measured.velocity - before[1]) / (time - before[0])
                errors.append(self._output.acceleration - acceleration)
        return errors

    def _arrive(self, goal: _Goal, time: float, measured: JointState) -> None:
        """Ends a goal whose trajectory is over, where it is due."""
        errors = [self._error, self._error_rate]
        if goal.tolerances.inside_goal(errors):
            goal.handle.end("succeeded", ErrorCode.SUCCESSFUL, f"goal reached at t = {time:.3f} s", time)
            self._forget()
            return
        late = self._reference.clock(time) - self._reference.end
        if late > goal.tolerances.goal_time:
            text = goal.tolerances.goal_text(self._facts, errors, time, late)
            self._abort(goal, ErrorCode.GOAL_TOLERANCE_VIOLATED, text, time, measured)
        elif late > self._timeout:
            text = f"{goal.tolerances.goal_text(self._facts, errors, time, late)}, cmd_timeout {self._timeout:g} s"
            goal.handle.end("aborted", ErrorCode.GOAL_TOLERANCE_VIOLATED, f"controller '{self.name}': {text}", time)
            self._forget()

    def _abort(self, goal: _Goal, code: ErrorCode, text: str, time: float, measured: JointState) -> None:
        goal.handle.end("aborted", code, f"controller '{self.name}': {text}", time)
        self._forget()
        if self._compat != "ros1":
            self._reference.hold(Course.hold(measured.position), time=time)
            self._compare(measured)

    def _forget(self) -> None:
        self._goal = None
        self._bound = np.inf
        self._before = None

    def _turn(self, time: float, period: float, measured: JointState) -> None:
        """What was asked for since the last update: to be active, a new goal, to stop."""
        if not 0.0 < period < np.inf:
            raise InvalidArgument("CTRL105", f"controller '{self.name}': a period of {period} s; expected more than 0")
        self._waiting = False
        if not self._activated:
            self._activated = True
            if self._pid is not None:
                self._pid.reset()
            self._reference.hold(Course.hold(measured.position), time=time)
        if self._next is not None:
            self._begin(self._next, time, period, measured)
        elif self._stop:
            self._come_to_rest(time, period)
        self._next, self._stop = None, False

    def _begin(self, goal: _Goal, time: float, period: float, measured: JointState) -> None:
        """The waiting goal becomes the active one: its references for every tick, once."""
        reference, facts = self._reference, self._facts.some(goal.trajectory.names)
        now = self._now(time)
        was_active = reference.moving
        course = reference.now(time) if self._replaces else Course.hold(now[POSITION], now[EFFORT])
        later = goal.start_time - time if goal.start_time > 0.0 else 0.0
        begin = max(later, 0.0) if self._replaces else 0.0
        if begin > 0.0:
            start = course.sample(np.array([begin]))[0]
        else:
            start = now
            if not self._from_desired and not (self._replaces and was_active):
                start[POSITION], start[VELOCITY], start[ACCELERATION] = measured.position, measured.velocity, 0.0
        columns = self._columns(goal.trajectory.names)
        whole = lead_in(
            goal.trajectory, start[:, columns], facts, ago=begin - later, smooth=self._smooth,
            interpolation=self._interpolation,
        )  # fmt: skip
        course = course.with_part(Part(columns, whole, begin))
        samples = course.ticks(period)
        broken = outside_limits(samples[:, POSITION], self._facts, period)
        if broken is not None:
            goal.handle.end("aborted", ErrorCode.INVALID_GOAL, f"controller '{self.name}': {broken}", time)
            self._come_to_rest(time, period)
            return
        self._goal = _Goal(goal.handle, goal.trajectory, goal.tolerances, goal.start_time, later)
        self._bound = goal.tolerances.bound
        reference.follow(course, samples, time=time, period=period, speed=self._speed)
        reference.advance(time, period)

    def _now(self, time: float) -> Array:
        """(4, n) what is followed now, in the seconds of a trajectory; paused, nothing moves."""
        now = self._reference.row(time)
        if self._speed not in (0.0, 1.0):
            now[VELOCITY] /= self._speed
            now[ACCELERATION] /= self._speed**2
        return now

    def _columns(self, names: tuple[str, ...]) -> Columns:
        if names == self.joints:
            return slice(None)
        return np.array([self.joints.index(name) for name in names], dtype=np.intp)

    def _come_to_rest(self, time: float, period: float) -> None:
        now = self._reference.row(time)
        if self._stop_duration > 0.0:
            course = stopping_in(now, self._stop_duration)
        else:
            course = decelerating(now, self._deceleration, together=self._stops_together)
        if course.parts:
            self._reference.follow(course, course.ticks(period), time=time, period=period)
            self._reference.advance(time, period)
        else:
            self._reference.hold(course, time=time)

    def _cancel(self, handle: GoalHandle) -> None:
        handle.end("canceled", ErrorCode.SUCCESSFUL, f"canceled at t = {self._time:.3f} s", self._time)
        if self._next is not None and self._next.handle is handle:
            self._next = None
        if self._goal is not None and self._goal.handle is handle:
            self._forget()
            self._stop = self._waiting = True

    def _feedback(self) -> Feedback:
        goal = self._goal
        elapsed = self._reference.clock(self._time)
        index = 0
        if goal is not None:
            elapsed -= goal.begin
            times = goal.trajectory.times
            index = min(int(np.searchsorted(times, elapsed, side="right")), len(times) - 1)
        return Feedback(
            elapsed=elapsed,
            desired=self._desired.copy(),
            actual=self._desired - self._error,
            index=index,
            desired_velocity=self._desired_velocity.copy(),
            actual_velocity=self._desired_velocity - self._error_rate,
        )


def build(name: str, spec: JointTrajectorySpec, fit: Fit) -> JointTrajectoryController:
    """The controller of a spec."""
    joints = [fit.robot.joint(joint) for joint in spec.joints]
    wants: FeedForward = "gravity" if spec.gravity_compensation else "none"
    return JointTrajectoryController(
        name=name,
        joints=spec.joints,
        command_interfaces=spec.interfaces,
        state_interfaces=spec.state_interfaces,
        gains=spec.gains,
        constraints=spec.constraints,
        limits=[joint.limits for joint in joints],
        types=[joint.type for joint in joints],
        feed_forward="inverse_dynamics" if spec.inverse_dynamics else wants,
        compat=fit.compat,
        allow_partial_joints_goal=spec.allow_partial_joints_goal,
        allow_nonzero_velocity_at_trajectory_end=spec.allow_nonzero_velocity_at_trajectory_end,
        allow_integration_in_goal_trajectories=spec.allow_integration_in_goal_trajectories,
        allow_trajectory_replacement=spec.allow_trajectory_replacement,
        interpolation_method=spec.interpolation_method,
        interpolate_from_desired_state=spec.interpolate_from_desired_state,
        cmd_timeout=spec.cmd_timeout,
        stop_trajectory_duration=spec.stop_trajectory_duration,
        speed_scaling=spec.speed_scaling.initial_scaling_factor,
        positions_upsampling=spec.positions_upsampling.enable,
    )


def check(spec: JointTrajectorySpec, robot: RobotModel) -> Iterator[Problem]:
    """Interfaces that do not go together; gains and tolerances of joints that it does not have, gains all zero; an
    effort added where none is commanded."""
    yield from strangers(spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    yield from strangers(spec.joints, spec.constraints.joints, ("constraints", "joints"), "tolerances", "CTRL104")
    key = "command_interfaces" if spec.command_interfaces else "command_interface"
    if spec.command_interface is not None and spec.command_interfaces:
        yield Problem((key,), "command_interface and command_interfaces say the same", "keep the list", "CTRL107")
    wrong = refused(spec.interfaces, spec.state_interfaces)
    if wrong is not None:
        where = key if wrong[0].startswith(("command", "unknown command")) else "state_interfaces"
        yield Problem((where,), wrong[0], wrong[1], "CTRL107")
        return
    if controlled_by_error(spec.interfaces):
        yield from idle_gains(spec.joints, spec.gains, spec.interfaces[0])
    if "effort" not in spec.interfaces:
        for word in ("gravity_compensation", "inverse_dynamics"):
            if getattr(spec, word):
                message = f"{word} adds an effort, but its interface is {', '.join(spec.interfaces)}"
                yield Problem((word,), message, "use command_interface: effort, or leave it out", "CTRL147")


MEMBER = ControllerMember(name="joint_trajectory", spec=JointTrajectorySpec, build=build, check=check)
