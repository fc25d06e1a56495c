"""Goals, feedback and results of controllers, as FollowJointTrajectory and GripperCommand know them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

GoalStatus = Literal["active", "succeeded", "aborted", "canceled"]


class ErrorCode(IntEnum):
    """control_msgs/action/FollowJointTrajectory result codes."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended: code, and a text that names joint, value, limit and time."""

    status: GoalStatus
    code: ErrorCode
    text: str
    time: float
