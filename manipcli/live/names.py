"""Names and numbers that servers and clients of a live session share."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

DEFAULT_PORT: Final = 9090
"""rosbridge's."""
RUN_STEP: Final = "/task/run_step"
CHECK_STEP: Final = "/task/check_step"


class GoalStatus(IntEnum):
    """action_msgs/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class Result(IntEnum):
    """Codes of simulation_interfaces/Result."""

    UNSUPPORTED = 0
    OK = 1
    NOT_FOUND = 2
    FAILED = 4


def title(word: str) -> str:
    """`GetParam` of `get_param`."""
    return "".join(map(str.title, word.split("_")))
