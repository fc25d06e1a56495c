"""Commands on their way: from the process of the network to the control loop, until they are answered."""

from __future__ import annotations

import json
from collections.abc import Callable, Container
from typing import Any, Final

from manipcli.live.command import CALL_SERVICE, PUBLISH, SEND_GOAL, Answer, Command, nobody
from manipcli.live.lanes import is_urgent
from manipcli.live.link import SENT, TAKEN, WAITING, framed

READS: Final = 20
"""Most services that change nothing that wait for an answer, of guests; others still have as many places then."""
TOO_MANY: Final = "too many commands wait for the next tick"


class Pending:
    """Sends commands, and hands out their answers.

    Args:
        numbers: the shared numbers.
        write: writes to the socket, without waiting.
        readers: services that change nothing: they are carried out when the control loop has time.
    """

    def __init__(self, numbers: memoryview, write: Callable[[bytes], Any], readers: Container[str] = ()) -> None:
        self._numbers, self._write, self._readers = numbers, write, readers
        self._sent = 0
        self._published: dict[int, Command] = {}
        self._others: dict[int, Command] = {}
        self._reads: dict[int, Command] = {}

    def full(self, command: Command) -> bool:
        """Whether too many wait to take this command; never for an emergency stop and its release."""
        if self._only_reads(command):
            return len(self._reads) >= (READS if command.guest else 2 * READS)
        return not is_urgent(command) and bool(self._sent - self._numbers[TAKEN] >= WAITING)

    def put(self, command: Command) -> bool:
        """Send a command to the control loop; False if too many wait."""
        if self.full(command):
            return False
        self._sent += 1
        reads = self._only_reads(command)
        answered = 0 if command.answer is nobody and not reads else self._sent
        if answered:
            waiting = self._reads if reads else self._published if command.op == PUBLISH else self._others
            waiting[answered] = command
        # A message to a topic is only answered if it is refused, and then at once.
        self._published.pop(self._sent - 2 * WAITING, None)
        body = json.dumps((answered, command.op, command.name, command.id, command.json, reads))
        self._write(framed(body.encode()))
        self._numbers[SENT] = self._sent
        return True

    def put_soon(self, command: Command, soon: Callable[[Callable[[], object]], None]) -> bool:
        """As `put`, from another thread; `soon` calls in that of the network, where others may have come first."""
        if self.full(command):
            return False

        def put() -> None:
            if not self.put(command):
                command.answer(Answer(False, {}, text=TOO_MANY))

        soon(put)
        return True

    def answer(self, number: int, found: Answer) -> None:
        """Hand an answer to who sent the command."""
        command = self._reads.pop(number, None) or self._published.pop(number, None) or self._others.get(number)
        if command is None:
            return
        if command.op != SEND_GOAL or found.status is not None:
            self._others.pop(number, None)
        command.answer(found)

    def _only_reads(self, command: Command) -> bool:
        return command.op == CALL_SERVICE and command.name in self._readers
