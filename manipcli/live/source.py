"""Sources of commands: the network, or the log of a session that is simulated again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live.command import END, Command
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import JOINT_STATES, LIVE_COMMANDS
from manipcli.record.foreign.topics import open_topics


class Source(Protocol):
    """Where the control loop gets its commands."""

    def take(self, tick: int) -> Sequence[Command]:
        """The commands that take effect at control tick `tick`, in order; called again for a tick that waits."""
        ...

    def read(self) -> Command | None:
        """The next command that changes nothing, for when the loop has time; None: there is none."""
        ...

    def wait(self, seconds: float) -> bool:
        """Wait for a command, at most this wall time; False: none will come at this tick."""
        ...

    def give_back(self, commands: Sequence[Command]) -> None:
        """Take these again, before all others."""
        ...

    def end(self, command: Command) -> None:
        """A command has ended the session: those after it are for the next one."""
        ...


class Schedule:
    """Commands by tick: of a log, or of a test."""

    def __init__(self, commands: Mapping[int, Sequence[Command]]) -> None:
        self._commands = commands
        self._taken = -1

    def take(self, tick: int) -> Sequence[Command]:
        first, self._taken = tick != self._taken, tick
        return self._commands.get(tick, ()) if first else ()

    def read(self) -> Command | None:
        return None

    def wait(self, seconds: float) -> bool:
        return False

    def give_back(self, commands: Sequence[Command]) -> None:
        """No effect: the session of a schedule ends with it."""

    def end(self, command: Command) -> None:
        """No effect."""


def recorded_commands(log: Path, period: float, *, failed: bool) -> Schedule:
    """The commands of the log of a live session.

    Args:
        log: path of the log.
        period: [s] of its control loop.
        failed: whether the simulation failed, so that it ends by itself. A session that was killed ends after the last
            tick in its log.

    Raises:
        InvalidInput: LIVE110 a command is damaged.
    """
    found: dict[int, list[Command]] = {}
    ended = False
    try:
        content = open_topics(log)
        for _, data, places in content.messages([LIVE_COMMANDS]):
            for start, length in zip(places.starts.tolist(), places.lengths.tolist(), strict=True):
                tick, command = _command(data[start : start + length])
                found.setdefault(tick, []).append(command)
                ended = ended or command.op == END
    except CdrError as error:
        raise InvalidInput([Diagnostic("LIVE110", f"{log.name}: a command of the session {error}")]) from error
    if not ended and not failed:
        last = content.all[JOINT_STATES].last if JOINT_STATES in content.all else 0
        found.setdefault(round(last / (period * 1e9)) + 1, []).append(Command(END, ""))
    return Schedule(found)


def _command(data: bytes) -> tuple[int, Command]:
    reader = CdrReader(data)
    reader.header()
    tick = reader.u32()
    op, name, id_, json = (reader.text() for _ in range(4))
    return tick, Command(op, name, id_, json)
