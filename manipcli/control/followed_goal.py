"""A goal that a trajectory controller has accepted, and when it is over."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Literal

import numpy as np

from manipcli.control.action import ErrorCode, GoalHandle
from manipcli.control.course import INSTANT
from manipcli.control.tolerances import Tolerances
from manipcli.control.trajectory_goal import JointFacts
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory

Then = Literal["go on", "let go", "hold measured"]
"""What the controller does after it was judged."""


@dataclass(slots=True, eq=False)
class FollowedGoal:
    """Its trajectory in the order of the controller's joints, its tolerances, and how patient it is.

    Attributes:
        controller: name, for texts.
        timeout: [s] after its end it is given up.
        begin: [s] its time 0 in the clock of the course, once it is followed.
    """

    controller: str
    facts: JointFacts
    handle: GoalHandle
    trajectory: JointTrajectory
    tolerances: Tolerances
    start_time: float
    timeout: float
    begin: float = 0.0
    _before: tuple[float, Array] | None = None
    _now: tuple[float, Array] | None = None

    def judge_path(
        self, errors: Array, acceleration: Array, measured_velocity: Array, time: float, clock: float
    ) -> Then:
        """Ends it where a joint left its path tolerance.

        Args:
            errors: (2, n) of position and velocity.
            acceleration: (n) of the reference.
            measured_velocity: (n).
            time: [s] now.
            clock: [s] of the course now.
        """
        judged = self._judged(errors, acceleration, measured_velocity, time)
        if not self.tolerances.outside_path(judged):
            return "go on"
        text = self.tolerances.path_text(self.facts, judged, time, clock - self.begin)
        return self._abort(ErrorCode.PATH_TOLERANCE_VIOLATED, text, time)

    def judge_end(self, errors: Array, acceleration: Array, measured_velocity: Array, time: float, late: float) -> Then:
        """Ends it, `late` [s] after its end, where it is reached or its patience is over.

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

        What is measured of an acceleration is the change of the velocity since the tick before.
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

    def preempt(self, time: float, *, as_canceled: bool) -> None:
        """Another goal takes its place."""
        if as_canceled:
            self.handle.end("canceled", ErrorCode.SUCCESSFUL, "preempted by a new goal", time)
        else:
            self.handle.end("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", time)

    def next_point(self, clock: float) -> int:
        """The point of its trajectory that comes next, or its last."""
        times = self.trajectory.times
        # bisect: numpy would copy all times first, where they are a column of something.
        return min(bisect_right(times, clock - self.begin + INSTANT), len(times) - 1)
