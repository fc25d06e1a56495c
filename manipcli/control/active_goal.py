"""Active goal of a trajectory controller: its tolerances, and when it ends."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from manipcli.control.action import ErrorCode, GoalHandle, GoalRejected
from manipcli.control.active_trajectory import INSTANT, Reference
from manipcli.control.trajectory_goal import JointFacts, TrajectoryGoal
from manipcli.control.transitions import Transitions
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.plan.motion import JointTolerance
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, JointConstraintSpec

DISABLED: Final = -1.0
"""Value of a tolerance that is not enforced."""

QUANTITIES: Final = (("", ""), ("velocity ", "/s"), ("acceleration ", "/s^2"))
"""Rows of errors and tolerances (3, n): name, and suffix of the unit after that of the position."""
PATH: Final = ("path tolerance", "path velocity tolerance", "path acceleration tolerance")
GOAL: Final = ("goal tolerance", "stopped velocity tolerance", "goal acceleration tolerance")


@dataclass(frozen=True, slots=True, eq=False)
class Tolerances:
    """Greatest errors of position, velocity and acceleration: `path`, `goal` (3, n), infinite where not enforced.

    Attributes:
        path: before the end.
        goal: at the end.
        goal_time: [s] of grace after the end; infinite: no limit.
    """

    path: Array
    goal: Array
    goal_time: float

    @staticmethod
    def of(joints: tuple[str, ...], constraints: ConstraintsSpec, *, patient: bool = False) -> Tolerances:
        """Of the joints in their order.

        Args:
            joints: (n).
            constraints: of the controller.
            patient: whether a `goal_time` of 0 means no limit.

        Raises:
            InvalidArgument: a tolerance of a joint that is not one of them.
        """
        unknown = sorted(set(constraints.joints) - set(joints))
        if unknown:
            raise InvalidArgument("CTRL104", f"tolerances of '{unknown[0]}', which is not a joint of the controller")
        each = [constraints.joints.get(joint, JointConstraintSpec()) for joint in joints]
        path, goal = np.full((2, 3, len(joints)), np.inf)
        path[0] = [constraint.trajectory or math.inf for constraint in each]
        goal[0] = [constraint.goal or math.inf for constraint in each]
        goal[1] = constraints.stopped_velocity_tolerance or math.inf
        endless = patient and constraints.goal_time == 0.0
        return Tolerances(path, goal, math.inf if endless else constraints.goal_time)

    @property
    def bound(self) -> float:
        """Bound on the norm of the position and velocity errors below which every path tolerance is kept.

        0 if an acceleration has a tolerance, on the path or at the end, which these errors do not determine.
        """
        if self.needs_acceleration:
            return 0.0
        return float(self.path[:2].min())

    @property
    def needs_acceleration(self) -> bool:
        """Whether an acceleration has a tolerance."""
        return bool(np.isfinite([self.path[2], self.goal[2]]).any())

    def adopted(self, goal: TrajectoryGoal, joints: tuple[str, ...]) -> tuple[Tolerances, tuple[str, ...]]:
        """The tolerances with those of a goal, and notes on what was not adopted.

        A value above 0 replaces, 0 keeps, -1 disables. With any other negative number or an unknown joint, all of the
        goal's tolerances are ignored, as in ROS 2.
        """
        path, goal_rows = np.array(self.path), np.array(self.goal)
        for rows, given, which in ((path, goal.path_tolerance, "path"), (goal_rows, goal.goal_tolerance, "goal")):
            for tolerance in given:
                wrong = _wrong(tolerance, joints)
                if wrong:
                    return self, (f"{which} tolerance: {wrong}; the controller's own tolerances apply",)
                j = joints.index(tolerance.name)
                for k, value in enumerate((tolerance.position, tolerance.velocity, tolerance.acceleration)):
                    rows[k, j] = _chosen(value, rows[k, j])
        time = goal.goal_time_tolerance
        if not (time >= 0.0 or time == DISABLED):
            wrong = f"goal time tolerance is {time:g} s; expected 0 or more, or -1"
            return self, (f"{wrong}; the controller's own tolerances apply",)
        return replace(self, path=path, goal=goal_rows, goal_time=_chosen(time, self.goal_time)), ()

    def outside_path(self, errors: Sequence[Array]) -> bool:
        """Whether a joint is outside its path tolerance; `errors` of position, velocity and, if known, acceleration."""
        return any(bool((np.abs(error) > limit).any()) for error, limit in zip(errors, self.path, strict=False))

    def inside_goal(self, errors: Sequence[Array]) -> bool:
        """Whether every joint is inside its goal tolerances, now."""
        return all(bool((np.abs(error) <= limit).all()) for error, limit in zip(errors, self.goal, strict=False))

    def path_text(self, facts: JointFacts, errors: Sequence[Array], time: float, elapsed: float) -> str:
        joint, what = _worst(facts, errors, self.path, PATH)
        return f"joint '{joint}' exceeds its {what}, at t = {time:.3f} s ({elapsed:.3f} s into the goal)"

    def goal_text(self, facts: JointFacts, errors: Sequence[Array], time: float, late: float) -> str:
        joint, what = _worst(facts, errors, self.goal, GOAL)
        grace = "unlimited" if math.isinf(self.goal_time) else f"{self.goal_time:.6g} s"
        grace += "" if self.goal_time > 0.0 else ": no grace; with `compat: ros2`: unlimited"
        return (
            f"joint '{joint}' is outside its {what}, at t = {time:.3f} s, "
            f"{late:.3f} s after the end (goal_time {grace})"
        )


def _worst(facts: JointFacts, errors: Sequence[Array], limits: Array, called: Sequence[str]) -> tuple[str, str]:
    """The joint whose error is the largest multiple of its limit, and a text on both."""
    shares = np.array([np.abs(error) / limit for error, limit in zip(errors, limits, strict=False)])
    k, j = (int(i) for i in np.unravel_index(np.argmax(shares), shares.shape))
    quantity, per = QUANTITIES[k]
    unit = facts.units[j] + per
    text = f"{called[k]}: {quantity}error {errors[k][j]:+.6g} {unit}, limit {limits[k, j]:.6g} {unit}"
    return facts.joints[j], text


def _wrong(tolerance: JointTolerance, joints: tuple[str, ...]) -> str:
    """Why a tolerance is invalid; empty if it is valid."""
    if tolerance.name not in joints:
        near = did_you_mean(tolerance.name, joints, kind="joints")
        return f"'{tolerance.name}' is not a joint of the controller" + (f" ({near})" if near else "")
    for (quantity, _), value in zip(
        QUANTITIES, (tolerance.position, tolerance.velocity, tolerance.acceleration), strict=True
    ):
        if not (value >= 0.0 or value == DISABLED):
            return f"{quantity or 'position '}of joint '{tolerance.name}' is {value:g}; expected 0 or more, or -1"
    return ""


def _chosen(value: float, default: float) -> float:
    """The value if above 0, the default if 0, infinite if -1."""
    if value == DISABLED:
        return math.inf
    return value if value > 0.0 else float(default)


Then = Literal["go on", "let go", "hold measured"]
"""What the controller does after the tolerances were checked."""


@dataclass(slots=True, eq=False)
class ActiveGoal:
    """A goal's trajectory in the order of the controller's joints, its tolerances and its timeout.

    Attributes:
        controller: name, for texts.
        timeout: [s] after its end, when it is aborted.
        begin: [s] of its time 0 in the clock of the active trajectory, once it is followed.
        unchecked: whether its way from the measured state is not checked yet, because that was unknown.
    """

    controller: str
    facts: JointFacts
    handle: GoalHandle
    trajectory: JointTrajectory
    tolerances: Tolerances
    start_time: float
    timeout: float
    begin: float = 0.0
    unchecked: bool = False
    _before: tuple[float, Array] | None = None
    _now: tuple[float, Array] | None = None

    def reachable(
        self, transitions: Transitions, reference: Reference, time: float, period: float, position: Array
    ) -> bool:
        """Whether its first point can be reached in time from `position` (n); if not, it is aborted.

        Args:
            transitions: of the controller.
            reference, time, period: of the tick at which it begins.
            position: measured.
        """
        try:
            transitions.check_way(self.trajectory, self.start_time, reference, time - period, period, position)
        except GoalRejected as refused:
            text = f"controller '{self.controller}': {refused.findings[0].message}"
            self.handle.end("aborted", ErrorCode.INVALID_GOAL, text, time)
            return False
        return True

    def judge_path(
        self, errors: Array, acceleration: Array, measured_velocity: Array, time: float, clock: float
    ) -> Then:
        """Aborts the goal if a joint exceeds its path tolerance.

        Args:
            errors: (2, n) of position and velocity.
            acceleration: (n) of the reference.
            measured_velocity: (n).
            time: [s] now.
            clock: [s] of the active trajectory now.
        """
        judged = self._judged(errors, acceleration, measured_velocity, time)
        if not self.tolerances.outside_path(judged):
            return "go on"
        text = self.tolerances.path_text(self.facts, judged, time, clock - self.begin)
        return self._abort(ErrorCode.PATH_TOLERANCE_VIOLATED, text, time)

    def judge_end(self, errors: Array, acceleration: Array, measured_velocity: Array, time: float, late: float) -> Then:
        """Ends the goal, `late` [s] after its end, if it is reached or its goal time is over.

        Args:
            errors, acceleration, measured_velocity, time: as for `judge_path`.
            late: see above.
        """
        judged = self._judged(errors, acceleration, measured_velocity, time)
        known = len(judged) == len(self.tolerances.goal) or not self.tolerances.needs_acceleration
        if known and self.tolerances.inside_goal(judged):
            self.handle.end("succeeded", ErrorCode.SUCCESSFUL, f"goal reached at t = {time:.3f} s", time)
            return "let go"
        if late <= min(self.tolerances.goal_time, self.timeout):
            return "go on"
        text = self.tolerances.goal_text(self.facts, judged, time, late)
        if late > self.tolerances.goal_time:
            return self._abort(ErrorCode.GOAL_TOLERANCE_VIOLATED, text, time)
        self._abort(ErrorCode.GOAL_TOLERANCE_VIOLATED, f"{text}, cmd_timeout {self.timeout:.6g} s", time)
        return "let go"

    def _judged(self, errors: Array, acceleration: Array, measured_velocity: Array, time: float) -> list[Array]:
        """Errors of position, velocity and, where the goal has a tolerance for it and it is known, acceleration.

        The measured acceleration is the change of the velocity since the previous tick.
        """
        judged = [errors[0], errors[1]]
        if self.tolerances.needs_acceleration:
            if self._now is None or time != self._now[0]:
                self._before, self._now = self._now, (time, np.array(measured_velocity))
            if self._before is not None and time > self._before[0]:
                judged.append(acceleration - (measured_velocity - self._before[1]) / (time - self._before[0]))
        return judged

    def _abort(self, code: ErrorCode, text: str, time: float) -> Then:
        self.handle.end("aborted", code, f"controller '{self.controller}': {text}", time)
        return "hold measured"

    def preempt(self, time: float, *, as_canceled: bool, by: str = "a new goal") -> None:
        if as_canceled:
            self.handle.end("canceled", ErrorCode.SUCCESSFUL, f"preempted by {by}", time)
        else:
            self.handle.end("aborted", ErrorCode.INVALID_GOAL, f"preempted by {by}", time)

    def next_point(self, clock: float) -> int:
        """Index of the next point of its trajectory, or of its last."""
        times = self.trajectory.times
        # bisect: numpy would copy all times first, where they are a column of something.
        return min(bisect_right(times, clock - self.begin + INSTANT), len(times) - 1)
