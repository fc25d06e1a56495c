"""Commands from outside: what a client asks of the session, and how it is answered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

Op = str
PUBLISH: Final = "publish"
SEND_GOAL: Final = "send_action_goal"
CANCEL_GOAL: Final = "cancel_action_goal"
CALL_SERVICE: Final = "call_service"
END: Final = "end"

STOP: Final = "/emergency_stop"
RELEASE: Final = "/emergency_stop_release"
"""Services that are never refused because others wait."""

Values = dict[str, object]


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer to a command: `ok`, the values of a response, a feedback or a result, or the text of an error.

    `status`: of a goal that ended, as in action_msgs/GoalStatus; None for anything else.
    """

    ok: bool
    values: Values
    text: str = ""
    status: int | None = None


def nobody(answer: Answer) -> None:
    """Drops an answer."""


@dataclass(frozen=True, slots=True)
class Command:
    """One command.

    Attributes:
        op: one of the words above.
        name: of the topic, action or service.
        id: of an action goal, distinct in the session; "" for others.
        json: the message, goal or request, complete and valid for its type. The log has this text, so that a session
            that is simulated from its log reads the same numbers.
        answer: called in the thread of the control loop; it must not block.
    """

    op: Op
    name: str
    id: str = ""
    json: str = "{}"
    answer: Callable[[Answer], None] = nobody


class Goal(Protocol):
    """An active goal of an action."""

    @property
    def command(self) -> Command:
        """The command that sent it."""
        ...

    def cancel(self) -> None:
        """Cancel it; its result follows at a later tick."""
        ...

    def step(self, *, due: bool) -> Answer | None:
        """After a tick: its result (an answer with a status), or its feedback if that is due; None: neither."""
        ...
