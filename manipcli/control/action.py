"""Goals, feedback and results of controllers, in the sense of FollowJointTrajectory and GripperCommand.

`controller.send_goal(...)` returns a `GoalHandle`; the controller ends it in a later update. The session and the Python
API use the same handles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

import numpy as np

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.plan.motion import Reflex

GoalStatus = Literal["active", "succeeded", "aborted", "canceled"]
FingerStop = Literal["contact", "stalled", "reached"]
"""Why a finger stopped: it met the force, it was blocked, or it reached its target without either."""


class ErrorCode(IntEnum):
    """control_msgs/action/FollowJointTrajectory result codes."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class GoalRejected(InvalidArgument):
    """A goal that the controller refuses; `error_code` is ROS's result code."""

    def __init__(
        self, code: str, message: str, *, hint: str | None = None, error_code: ErrorCode = ErrorCode.INVALID_GOAL
    ) -> None:
        super().__init__(code, message, hint=hint)
        self.error_code = error_code


def refuse_inactive(controller: str, accepts_goals: bool) -> None:
    """
    Raises:
        GoalRejected: the controller is inactive.
    """
    if not accepts_goals:
        hint = (
            "activate it first: `switch_controllers` in a task, `manager.switch(activate=...)` in Python, "
            "or `/controller_manager/switch_controller` in a live session"
        )
        raise GoalRejected("CTRL122", f"controller '{controller}' is not active and accepts no goals", hint=hint)


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended: code, a text that names joint, value, limit and time, and the `time` [s].

    `fingers`: for a gripper goal, why each finger stopped, in the order of the goal's fingers.
    """

    status: GoalStatus
    code: ErrorCode
    text: str
    time: float
    fingers: tuple[FingerStop, ...] = ()

    @property
    def reached_goal(self) -> bool:
        """For a gripper goal: whether every finger reached its target."""
        return bool(self.fingers) and all(stop == "reached" for stop in self.fingers)

    @property
    def stalled(self) -> bool:
        """For a gripper goal: whether something stopped a finger, as when it grasps an object."""
        return any(stop in ("stalled", "contact") for stop in self.fingers)


@dataclass(frozen=True, slots=True, eq=False)
class Feedback:
    """Progress of an active goal.

    Attributes:
        elapsed: [s] of the goal's own clock since it began; negative before its start time.
        desired, actual: (n) copies of the desired and the measured position; rad or m. For a continuous joint, `actual`
            is within half a turn of `desired`.
        index: the next point of the goal, or its last.
        desired_velocity, actual_velocity: (n), per second; empty if the controller does not report them.
    """

    elapsed: float
    desired: Array
    actual: Array
    index: int = 0
    desired_velocity: Array = field(default_factory=lambda: np.zeros(0))
    actual_velocity: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def error(self) -> Array:
        """(n) desired minus actual."""
        return self.desired - self.actual


class GoalHandle:
    """A goal that a controller has accepted.

    Attributes:
        result: None while the goal is active, then how it ended.
        notes: which parts of the goal were not adopted, and why.
        bounded: joints whose position at the end has a tolerance, which the controller checks.
    """

    __slots__ = ("_cancel", "_feedback", "bounded", "notes", "result")

    def __init__(
        self,
        *,
        cancel: Callable[[GoalHandle], None],
        feedback: Callable[[], Feedback],
        notes: tuple[str, ...] = (),
        bounded: frozenset[str] = frozenset(),
    ) -> None:
        self.result: GoalResult | None = None
        self.notes = notes
        self.bounded = bounded
        self._cancel = cancel
        self._feedback = feedback

    @property
    def status(self) -> GoalStatus:
        return "active" if self.result is None else self.result.status

    @property
    def active(self) -> bool:
        return self.result is None

    def feedback(self) -> Feedback:
        """Where the controller is now; after the goal ended: where the controller holds."""
        return self._feedback()

    def cancel(self) -> None:
        """Ends the goal as canceled; the controller stops and holds. No effect on a goal that has ended."""
        if self.result is None:
            self._cancel(self)

    def end(
        self, status: GoalStatus, code: ErrorCode, text: str, time: float, fingers: tuple[FingerStop, ...] = ()
    ) -> None:
        """Ends the goal; called by the controller. Only the first call has an effect."""
        if self.result is None:
            self.result = GoalResult(status=status, code=code, text=text, time=time, fingers=fingers)


@dataclass(frozen=True, slots=True, eq=False)
class GripperGoal:
    """Target of a hand, and what may stop it.

    Attributes:
        target: (n) rad or m, in the order of the controller's joints; one number: for all of them.
        force: [N] at which a finger stops; None: contact does not stop it (to open).
        max_effort: (n) N m or N, or one number for all, for this goal and after it; None: the controller's.
        fingers: joint indices of each finger, every joint in exactly one; empty: each joint is a finger.
        reflex: pressing more against slip, while the hand holds; None: without. It needs taxels with shear.
    """

    target: Array | float
    force: float | None = None
    max_effort: Array | float | None = None
    fingers: tuple[tuple[int, ...], ...] = ()
    reflex: Reflex | None = None
