"""Messages of one channel to columns of numbers, with one numpy index per run of numbers over all messages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from manipcli.core.geometry import Array
from manipcli.record.cdr import CdrError
from manipcli.record.decode import Int, Layouts, Run, rows, runs
from manipcli.record.definition import Message, read_definition
from manipcli.record.read.chunk import Places
from manipcli.record.schemas import schema_text


@dataclass(frozen=True, slots=True)
class NamedRuns:
    """What a message holds: its names, and (offset, count) of its runs of doubles."""

    names: tuple[str, ...]
    runs: tuple[tuple[int, int], ...]


Choose = Callable[[Sequence[Run], memoryview], NamedRuns]
"""The values of a message, and its bytes, to what is wanted of it."""


class Columns:
    """The numbers of one channel on their way from chunks to spans.

    Args:
        topic: its name in errors.
        kind: of its messages.
        choose: what is wanted of a message.
        names: of the joints or bodies that every message must hold, in this order.
        widths: of the runs of doubles that every message must hold.
    """

    def __init__(self, topic: str, kind: str, choose: Choose, names: tuple[str, ...], widths: tuple[int, ...]) -> None:
        self._topic = topic
        self._message = definition(kind)
        self._choose = choose
        self._names = names
        self._widths = widths
        self._layouts = Layouts(self._offsets)
        self._newest = -1
        self._parts: list[tuple[Int, list[Array]]] = []

    def __len__(self) -> int:
        """Messages that were added and not yet taken."""
        return sum(len(times) for times, _ in self._parts)

    def add(self, data: bytes, places: Places) -> None:
        """The channel's messages of one chunk.

        Raises:
            CdrError: a message is cut, holds other things than it should, or is older than the one before it.
        """
        times = np.concatenate(([self._newest], places.times))
        back = np.flatnonzero(np.diff(times) <= 0)
        if len(back):
            raise CdrError(f"time runs backwards in {self._topic} after t = {times[back[0]] / 1e9:.3f} s")
        self._newest = int(times[-1])
        numbers = [np.zeros((len(places.times), width)) for width in self._widths]
        for offsets, which in self._layouts.groups(data, places.starts, places.lengths):
            for k, (offset, width) in enumerate(zip(offsets, self._widths, strict=True)):
                if width:
                    found = rows(data, places.starts[which] + offset, 8 * width).view("<f8")
                    if len(which) == len(places.times):
                        numbers[k] = found
                    else:
                        numbers[k][which] = found
        self._parts.append((places.times, numbers))

    def take(self, count: int) -> tuple[Int, list[Array]]:
        """The first `count` messages: log times [ns], and each run (count, width). The columns let go of them."""
        if len(self._parts) != 1:
            times = np.concatenate([np.zeros(0, dtype=np.int64), *(times for times, _ in self._parts)])
            empty = [np.zeros((0, width)) for width in self._widths]
            runs = [np.concatenate([none, *(runs[k] for _, runs in self._parts)]) for k, none in enumerate(empty)]
            self._parts = [(times, runs)]
        times, runs = self._parts.pop()
        if count < len(times):
            self._parts = [(times[count:], [run[count:] for run in runs])]
        return times[:count], [run[:count] for run in runs]

    def _offsets(self, message: memoryview) -> tuple[tuple[int, ...], list[tuple[int, int]]]:
        """Where the wanted numbers of a message are, and the counts and texts that decide it."""
        found = runs(self._message, message)
        holds = self._choose(found, message)
        if holds.names != self._names:
            raise CdrError(f"{self._topic} names other joints or bodies than the metadata")
        if tuple(count for _, count in holds.runs) != self._widths:
            raise CdrError(f"{self._topic} has another number of values than of names")
        guards = [(run.begin, run.end) for run in found if run.code in ("", "#")]
        return tuple(offset for offset, _ in holds.runs), guards


@cache
def definition(kind: str) -> Message:
    """One of the types of a recording."""
    return read_definition(kind, schema_text(kind))


def joint_state_runs(found: Sequence[Run], data: memoryview) -> NamedRuns:
    """sensor_msgs/JointState: position, velocity, effort."""
    fields = ("position", "velocity", "effort")
    return NamedRuns(_texts(found, data, "name"), tuple(_run(found, name) for name in fields))


def body_runs(bodies: frozenset[str], world: str) -> Choose:
    """tf2_msgs/TFMessage: x y z and quaternion xyzw of every one of `bodies` in the world."""

    def choose(found: Sequence[Run], data: memoryview) -> NamedRuns:
        parents = _texts(found, data, "transforms", "header", "frame_id")
        children = _texts(found, data, "transforms", "child_frame_id")
        places = [run.offset for run in found if run.fields == ("transforms", "transform", "translation", "x")]
        each = zip(parents, children, places, strict=True)
        mine = [(child, at) for parent, child, at in each if parent == world and child in bodies]
        return NamedRuns(tuple(child for child, _ in mine), tuple((at, 7) for _, at in mine))

    return choose


def controller_state_runs(found: Sequence[Run], data: memoryview) -> NamedRuns:
    """JointTrajectoryControllerState: reference position and velocity, feedback position, output."""
    outputs = [_run(found, "output", name) for name in ("positions", "velocities", "accelerations", "effort")]
    return NamedRuns(
        _texts(found, data, "joint_names"),
        (
            _run(found, "reference", "positions"),
            _run(found, "reference", "velocities"),
            _run(found, "feedback", "positions"),
            next((run for run in outputs if run[1]), outputs[0]),
        ),
    )


def _texts(found: Sequence[Run], data: memoryview, *fields: str) -> tuple[str, ...]:
    return tuple(str(run.value(data, 0)) for run in found if not run.code and run.fields == fields)


def _run(found: Sequence[Run], *fields: str) -> tuple[int, int]:
    """Offset and count of an array of numbers; none of them where it is empty."""
    return next(((run.offset, run.count) for run in found if run.array and run.fields == fields), (0, 0))
