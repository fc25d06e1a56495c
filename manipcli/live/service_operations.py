"""Operation of a client on services: call_service."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from manipcli.live import command as words
from manipcli.live.command import Answer
from manipcli.live.connection import Connection
from manipcli.live.fields import Refused, arguments, near, rooted, text_of
from manipcli.live.offer import request_type
from manipcli.record.json_message import definition

MAX_CALLS: Final = 100
"""Services of one client that wait for a response."""


class ServiceOperations:
    """That of one client."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._calls = 0

    def call(self, frame: Mapping[str, Any]) -> None:
        """Answer a service of rosapi; hand the request of another to the control loop."""
        name = rooted(text_of(frame, "service"))
        offer, rosapi = self._connection.offer, self._connection.services.rosapi
        kind = offer.services.get(name)
        if kind is None:
            if name not in rosapi.names:
                raise Refused(f"unknown service '{name[:80]}'; {near(name, [*offer.services, *rosapi.names])}")
            self.respond(frame, Answer(True, rosapi.call(name, frame.get("args", {}))))
            return
        if self._calls >= MAX_CALLS:
            raise Refused(f"more than {MAX_CALLS} services wait for a response")
        self._connection.check_right(name)  # before the long check of the message
        message = arguments(definition(request_type(kind)), frame.get("args", {}))

        def answered(answer: Answer) -> None:
            self._calls -= 1
            self.respond(frame, answer)

        self._connection.command(words.CALL_SERVICE, name, "", message, answered)
        self._calls += 1

    def respond(self, frame: Mapping[str, Any], answer: Answer) -> None:
        """Send a response; the values of an error are its text."""
        values: object = answer.values if answer.ok else answer.text
        found = {"op": "service_response", "service": frame["service"], "values": values, "result": answer.ok}
        self._connection.answer(found, frame.get("id"))
