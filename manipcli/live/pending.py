"""Commands on their way: from the process of the network to the control loop, until they are answered."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from manipcli.live.command import PUBLISH, SEND_GOAL, Answer, Command, nobody
from manipcli.live.link import SENT, TAKEN, WAITING, framed


class Pending:
    """Sends commands, and hands out their answers.

    Args:
        numbers: the shared numbers.
        write: writes to the socket, without waiting.
    """

    def __init__(self, numbers: memoryview, write: Callable[[bytes], Any]) -> None:
        self._numbers, self._write = numbers, write
        self._sent = 0
        self._published: dict[int, Command] = {}
        self._others: dict[int, Command] = {}

    @property
    def full(self) -> bool:
        """Whether too many commands wait for the next tick."""
        return bool(self._sent - self._numbers[TAKEN] >= WAITING)

    def put(self, command: Command) -> bool:
        """Send a command to the control loop; False if too many wait for its next tick."""
        if self.full:
            return False
        self._sent += 1
        answered = 0 if command.answer is nobody else self._sent
        if answered:
            waiting = self._published if command.op == PUBLISH else self._others
            waiting[answered] = command
        # A message to a topic is only answered if it is refused, and then at once.
        self._published.pop(self._sent - 2 * WAITING, None)
        body = json.dumps((answered, command.op, command.name, command.id, command.json))
        self._write(framed(body.encode()))
        self._numbers[SENT] = self._sent
        return True

    def answer(self, number: int, found: Answer) -> None:
        """Hand an answer to who sent the command."""
        command = self._published.pop(number, None) or self._others.get(number)
        if command is None:
            return
        if command.op != SEND_GOAL or found.status is not None:
            self._others.pop(number, None)
        command.answer(found)
