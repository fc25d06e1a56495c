"""What the operations of one client share: its rights, its answers, and where its commands go."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from manipcli.live.command import Answer, Command
from manipcli.live.fields import Refused
from manipcli.live.offer import Offer
from manipcli.live.outbox import Outbox
from manipcli.live.pending import TOO_MANY
from manipcli.live.rosapi import Rosapi
from manipcli.record.json_message import compact

LEVELS: Final = ("none", "error", "warning", "info")
"""Of status messages; a client gets those up to its level."""
MAX_STATUS: Final = 1000
"""Longest text of a status [characters]."""


@dataclass(frozen=True, slots=True)
class Services:
    """What all clients share.

    Attributes:
        offer: names and types.
        latched: the last text of a latched topic; None before its first message.
        rosapi: answers its services.
        put: hands a command to the control loop; False if too many wait.
        in_network: calls in the thread of the network.
        subscribed: to be called when subscriptions have changed.
    """

    offer: Offer
    latched: Callable[[str], str | None]
    rosapi: Rosapi
    put: Callable[[Command], bool]
    in_network: Callable[[Callable[[], None]], None]
    subscribed: Callable[[], None]


class Connection:
    """One client.

    Args:
        number: of the connection in the session.
        commands: whether it may command.
        services: see there.

    Attributes:
        outbox: what waits to be sent.
        level: of the status messages that it wants; at first that of the protocol.
    """

    def __init__(self, number: int, *, commands: bool, services: Services) -> None:
        self.number, self.services = number, services
        self.outbox = Outbox()
        self.level = "error"
        self._commands = commands

    @property
    def offer(self) -> Offer:
        """Names and types."""
        return self.services.offer

    def answer(self, message: Mapping[str, object], id_: object = None) -> None:
        """Send a message, with the id of the operation that it answers, if that has one."""
        found = {**message, "id": id_} if isinstance(id_, str) else message
        self.outbox.answer(json.dumps(found, separators=(",", ":")))

    def status(self, level: str, text: str, id_: object = None) -> None:
        """Send a status message, if the client wants this level."""
        if LEVELS.index(level) <= LEVELS.index(self.level):
            self.answer({"op": "status", "level": level, "msg": text[:MAX_STATUS]}, id_)

    def check_right(self, name: str) -> None:
        """
        Raises:
            Refused: the client may only read.
        """
        if not self._commands and name not in self.offer.readers:
            raise Refused("this connection may only read: connect with the token that `manipcli serve` printed")

    def command(self, op: str, name: str, id_: str, message: object, answer: Callable[[Answer], None]) -> None:
        """Hand a command to the control loop.

        Args:
            op, name, id_: as in `Command`.
            message: complete and valid for its type.
            answer: called in the thread of the network.

        Raises:
            Refused: the client may only read, or too many commands wait.
        """
        self.check_right(name)

        def back(found: Answer) -> None:
            self.services.in_network(lambda: answer(found))

        text = compact(message)
        if not self.services.put(Command(op, name, id_, text, back, guest=not self._commands)):
            raise Refused(TOO_MANY)
