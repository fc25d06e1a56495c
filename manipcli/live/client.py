"""One client of the rosbridge protocol 2: its frames, and the operations that they name."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from manipcli.core.text import did_you_mean
from manipcli.live.action_operations import ActionOperations
from manipcli.live.budget import OPERATION, RATE, REFUSED_BURST, REFUSED_RATE, Budget
from manipcli.live.command import Answer
from manipcli.live.connection import LEVELS, Connection, Services
from manipcli.live.drops import report_drops
from manipcli.live.fields import Refused, text_of
from manipcli.live.frames import BadFrame, read_frame
from manipcli.live.service_operations import ServiceOperations
from manipcli.live.topic_operations import TopicOperations
from manipcli.record.json_message import BadMessage

_NO_SERVERS = "clients cannot offer services or actions to this server"
UNSUPPORTED: Final = {
    "auth": "the token is in the URL: ws://.../?token=...",
    "fragment": "send whole messages of at most 1 MiB",
    "png": "send JSON text",
    **dict.fromkeys(("advertise_service", "unadvertise_service", "service_response"), _NO_SERVERS),
    **dict.fromkeys(("advertise_action", "unadvertise_action", "action_feedback", "action_result"), _NO_SERVERS),
}
"""Operations of rosbridge that this server does not have, and what to do instead."""


class Client:
    """A connection and its operations.

    Args:
        number: of the connection in the session.
        commands: whether it may command.
        services: see there.

    Attributes:
        offence: why the connection is to be closed; "" if it is not.
    """

    def __init__(self, number: int, *, commands: bool, services: Services) -> None:
        self._connection = Connection(number, commands=commands, services=services)
        topics = TopicOperations(self._connection)
        self._services, self._actions = ServiceOperations(self._connection), ActionOperations(self._connection)
        self._budget, self._refusals = Budget(), Budget(REFUSED_RATE, REFUSED_BURST)
        self._warned = 0.0
        self.offence = ""
        self._operations: dict[str, Callable[[Mapping[str, Any]], None]] = {
            "advertise": topics.advertise,
            "unadvertise": topics.unadvertise,
            "publish": topics.publish,
            "subscribe": topics.subscribe,
            "unsubscribe": topics.unsubscribe,
            "call_service": self._services.call,
            "send_action_goal": self._actions.send_goal,
            "cancel_action_goal": self._actions.cancel,
            "set_level": self._set_level,
        }
        self.outbox, self.status = self._connection.outbox, self._connection.status

    def receive(self, text: str | bytes) -> bool:
        """Carry out one frame; whatever is wrong with it is a status message, or the answer that the client expects.

        Returns:
            Whether it was carried out and is short; the client has to wait after another one.
        """
        if not self._within_rate(len(text)):
            return False
        frame: dict[str, Any] = {}
        try:
            frame = read_frame(text)
            op = text_of(frame, "op")
            if op in UNSUPPORTED:
                raise Refused(f"op '{op}' is not supported: {UNSUPPORTED[op]}")
            if op not in self._operations:
                raise Refused(f"unknown op '{op[:60]}'; {did_you_mean(op[:60], self._operations, kind='ops')}")
            self._operations[op](frame)
        except (BadFrame, BadMessage, Refused) as error:
            self._refuse(frame, str(error), len(text))
            return False
        return len(text) < OPERATION

    def _refuse(self, frame: Mapping[str, Any], text: str, size: int) -> None:
        """An operation that waits for a response gets one; others get a status."""
        self._count_refusal(text, size)
        op = frame.get("op")
        if op == "call_service" and isinstance(frame.get("service"), str):
            self._services.respond(frame, Answer(False, {}, text=text))
        elif op == "send_action_goal" and isinstance(frame.get("action"), str):
            self._actions.result(frame, Answer(False, {}, text=text))
        else:
            self.status("error", text, frame.get("id"))

    def report_drops(self) -> list[str]:
        """See `drops.report_drops`."""
        return report_drops(self._connection)

    def _within_rate(self, size: int) -> bool:
        now = time.monotonic()
        if self._budget.spend(now, size):
            return True
        why = f"more than {RATE:g} operations per second; the others are dropped"
        if now - self._warned > 1.0:
            self._warned = now
            self.status("error", why)
        self._count_refusal(why, 0)
        return False

    def _count_refusal(self, why: str, size: int) -> None:
        if not self._refusals.spend(time.monotonic(), size):
            self.offence = f"too many refused operations; the last: {why}"

    def _set_level(self, frame: Mapping[str, Any]) -> None:
        level = text_of(frame, "level")
        if level not in LEVELS:
            raise Refused(f"unknown level '{level[:60]}'; expected {', '.join(LEVELS)}")
        self._connection.level = level
