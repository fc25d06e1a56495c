"""Order of the commands that wait for the same tick: an emergency stop is carried out first, and never refused.

A batch is all that has arrived since the tick before. Its order is that of arrival but for a stop, which overtakes what
came before it; a release stays in its place, unless a stop follows: the last one of both wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from manipcli.live.command import CALL_SERVICE, RELEASE, STOP, Command, nobody


def is_urgent(command: Command) -> bool:
    """Whether it stops the robot, or releases the stop."""
    return command.op == CALL_SERVICE and command.name in (STOP, RELEASE)


def stop_first(batch: Sequence[Command]) -> list[Command]:
    """The commands of a batch in the order in which they are carried out."""
    first = _overtaking(batch)
    return [*first, *(each for each in batch if not _has(first, each))] if first else [*batch]


def left_after(batch: Sequence[Command], end: Command) -> list[Command]:
    """What came after the command that ended the session, for the next one, which is not stopped.

    A stop that overtook that command is carried out again, without an answer.
    """
    at = next((k for k, each in enumerate(batch) if each is end), len(batch))
    done = _overtaking(batch)
    return [replace(each, answer=nobody) if _has(done, each) else each for each in batch[at + 1 :]]


def _overtaking(batch: Sequence[Command]) -> list[Command]:
    """The stops, and the releases before the last of them."""
    urgent = [each for each in batch if is_urgent(each)]
    while urgent and urgent[-1].name != STOP:
        urgent.pop()
    return urgent


def _has(commands: Sequence[Command], command: Command) -> bool:
    return any(each is command for each in commands)
