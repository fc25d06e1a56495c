"""Columns of numbers from the messages of one channel, with one numpy index per run over all messages."""

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
    """Names in a message, and (offset, count) of its runs of doubles."""

    names: tuple[str, ...]
    runs: tuple[tuple[int, int], ...]


Choose = Callable[[Sequence[Run], memoryview], NamedRuns]
"""Selects the wanted runs from the values and bytes of a message."""


class Columns:
    """Collects the numbers of one channel from chunks.

    Args:
        topic: topic name for errors.
        kind: type of its messages.
        choose: selects the wanted runs of a message.
        names: joints or bodies that every message must have, in this order.
        widths: widths of the runs of doubles that every message must have.
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
        """Number of messages that are added and not yet taken."""
        return sum(len(times) for times, _ in self._parts)

    @property
    def times(self) -> Int:
        """Log times [ns] of these messages."""
        return np.concatenate([np.zeros(0, dtype=np.int64), *(times for times, _ in self._parts)])

    def add(self, data: bytes, places: Places) -> None:
        """Add the messages of one chunk.

        Raises:
            CdrError: a message is truncated, has unexpected content, or is older than the previous one.
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
        """The first `count` messages: log times [ns], and each run (count, width). They are removed."""
        if len(self._parts) != 1:
            times = self.times
            empty = [np.zeros((0, width)) for width in self._widths]
            runs = [np.concatenate([none, *(runs[k] for _, runs in self._parts)]) for k, none in enumerate(empty)]
            self._parts = [(times, runs)]
        times, runs = self._parts.pop()
        if count < len(times):
            self._parts = [(times[count:], [run[count:] for run in runs])]
        return times[:count], [run[:count] for run in runs]

    def _offsets(self, message: memoryview) -> tuple[tuple[int, ...], list[tuple[int, int]]]:
        """Offsets of the wanted numbers, and the byte ranges of counts and texts that define the layout."""
        found = runs(self._message, message)
        holds = self._choose(found, message)
        if holds.names != self._names:
            raise CdrError(f"{self._topic} has other joints or bodies than the metadata")
        if tuple(count for _, count in holds.runs) != self._widths:
            raise CdrError(f"{self._topic} has different numbers of values and names")
        guards = [(run.begin, run.end) for run in found if run.code in ("", "#")]
        return tuple(offset for offset, _ in holds.runs), guards


@cache
def definition(kind: str) -> Message:
    """The message type `kind` of a recording."""
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
        frames = zip(parents, children, places, strict=True)
        mine = [(child, at) for parent, child, at in frames if parent == world and child in bodies]
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
    """Offset and count of an array of numbers; count 0 if it is empty."""
    return next(((run.offset, run.count) for run in found if run.array and run.fields == fields), (0, 0))
