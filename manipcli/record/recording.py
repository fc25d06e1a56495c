"""A log in memory, the only input of judge, replay and report.

Small parts are read at once. States are read span by span, so that the memory does not grow with the length of the log.
`read_recording` returns a recording in memory, `open_recording` one that reads its spans from the file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from manipcli.conditions.sensed import Readings
from manipcli.core.geometry import Array, Transform
from manipcli.model.state import Contact, WorldState


@dataclass(frozen=True, slots=True)
class TaskEvent:
    """`kind`: step_started, step_ended, ..., all in docs/reference/messages.md; `place`: file:line of the step."""

    time: float
    kind: str
    step: str
    verb: str
    outcome: str
    text: str
    place: str


@dataclass(frozen=True, slots=True)
class ControllerTrace:
    """Trace of a controller: arrays (T, n) on the control ticks."""

    name: str
    joints: tuple[str, ...]
    times: Array
    reference_position: Array
    reference_velocity: Array
    position: Array
    output: Array

    def map(self, change: Callable[[Array], Array]) -> ControllerTrace:
        """The trace with every array mapped."""
        return ControllerTrace(self.name, self.joints, *(change(array) for array in self.arrays))

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array, Array]:
        return self.times, self.reference_position, self.reference_velocity, self.position, self.output


@dataclass(frozen=True, slots=True)
class ContactSnapshot:
    """All contacts from `time` on, until the next snapshot."""

    time: float
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, slots=True)
class Span:
    """Successive control ticks with complete data.

    `states` has a leading time axis T, the traces of the controllers are on the same ticks, and `contacts` are the
    changes of contacts during the span. `believed` (T, k, 7): position and quaternion of the bodies with believed poses
    of their own. `readings`: those that arrived during the span, of the sensors that are read.
    """

    states: WorldState
    controllers: tuple[ControllerTrace, ...]
    contacts: tuple[ContactSnapshot, ...]
    believed: Array = field(default_factory=lambda: np.zeros((0, 0, 7)))
    readings: Mapping[str, Readings] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class BeliefSnapshot:
    """What the robot believed about an uncertain body from `time` [s] on.

    `X_WO`, and the covariance (6, 6) of position [m2] and rotation [rad2] about the axes of the world.
    """

    time: float
    body: str
    X_WO: Transform
    covariance: Array


EMBEDDED = "embedded_meshes"
"""Name of the metadata record of embedded meshes: URI -> name of the attachment."""

END = "end"
"""Name of the metadata record of the end of a run: status, and the cause of a failure."""


@dataclass(frozen=True, slots=True)
class Recording:
    """Content of a log.

    Attributes:
        joint_names, body_names: names in the order of the state arrays.
        spans: at least one, without gaps between them. Can be iterated repeatedly; each iteration of spans in a file
            reads the file.
        events: events of the task.
        metadata: name -> key -> value.
        attachments: name -> bytes.
        lost: why the end of the log is missing, or None.
        period: control period [s].
        absent: topics that the task excludes from the recording. Their states are NaN, and a controller whose state is
            absent has no trace.
        silent: topics without a message although a run records them: another program removed them, or the run ended
            before.
        believed_names: bodies with believed poses of their own.
        sensors: whose readings are in the spans.
        beliefs: what the robot believed at the start, and wherever it looked.

    `states`, `controllers` and `contacts` cover all spans and need a recording that is `whole`.
    Velocities of bodies are central differences of their recorded poses.
    """

    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    spans: Iterable[Span]
    events: tuple[TaskEvent, ...]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]
    lost: str | None
    period: float = 0.0
    absent: tuple[str, ...] = ()
    silent: tuple[str, ...] = ()
    believed_names: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    beliefs: tuple[BeliefSnapshot, ...] = ()

    @property
    def end(self) -> dict[str, str]:
        """How the run ended: `status` and `cause`; empty if it did not. Older logs have both in `run`."""
        return self.metadata.get(END) or self.metadata.get("run", {})

    def embedded_meshes(self) -> dict[str, bytes]:
        """The embedded mesh files by the URI in URDF and scene, with the material files of OBJ meshes; empty unless the
        run embeds meshes."""
        names = self.metadata.get(EMBEDDED, {})
        return {uri: self.attachments[name] for uri, name in names.items() if name in self.attachments}

    def unknown(self, topic: str) -> str:
        """Why the content of a topic is unknown; "" if it is known."""
        if topic in self.absent:
            return f"{topic} not recorded"
        return f"the log has no message of {topic}" if topic in self.silent else ""

    def whole(self) -> Recording:
        """The recording with all ticks in memory: about 1.2 kB per tick for an arm with a hand and two objects."""
        return replace(self, spans=(self._span(),))

    @property
    def states(self) -> WorldState:
        """The states of all control ticks, from 0."""
        return self._span().states

    @property
    def controllers(self) -> tuple[ControllerTrace, ...]:
        """Traces of the controllers on all ticks."""
        return self._span().controllers

    @property
    def contacts(self) -> tuple[ContactSnapshot, ...]:
        """All changes of contacts."""
        return self._span().contacts

    def _span(self) -> Span:
        match self.spans:
            case (Span() as only,):
                return only
        return joined(self.spans)


def joined(spans: Iterable[Span]) -> Span:
    """One span from at least one; each is released before the next is read."""
    iterator = iter(spans)
    first = next(iterator)
    following = next(iterator, None)
    if following is None:
        return first
    tables = [_Growing(array) for array in _arrays(first)]
    contacts = [*first.contacts]
    readings = {name: [each] for name, each in first.readings.items()}
    while following is not None:
        for table, array in zip(tables, _arrays(following), strict=True):
            table.append(array)
        contacts += following.contacts
        for name, more in following.readings.items():
            readings[name].append(more)
        following = next(iterator, None)
    arrays = (table.take() for table in tables)
    return Span(
        states=first.states.map(lambda _: next(arrays)),
        controllers=tuple(trace.map(lambda _: next(arrays)) for trace in first.controllers),
        contacts=tuple(contacts),
        believed=next(arrays),
        readings={
            name: Readings(np.concatenate([each.times for each in parts]), np.concatenate([e.values for e in parts]))
            for name, parts in readings.items()
        },
    )


def _arrays(span: Span) -> list[Array]:
    """All arrays of a span, states first, in the order of `map`."""
    found: list[Array] = []

    def keep(array: Array) -> Array:
        found.append(array)
        return array

    span.states.map(keep)
    for trace in span.controllers:
        found += trace.arrays
    return [*found, span.believed]


class _Growing:
    """A table that grows in place by a quarter, which needs half the memory of a list of parts and its
    concatenation."""

    def __init__(self, rows: Array) -> None:
        self._table = rows.copy()
        self._rows = len(rows)

    def append(self, rows: Array) -> None:
        end = self._rows + len(rows)
        if end > len(self._table):
            self._resize(max(end, len(self._table) + len(self._table) // 4))
        self._table[self._rows : end] = rows
        self._rows = end

    def take(self) -> Array:
        """All rows, read-only."""
        self._resize(self._rows)
        self._table.flags.writeable = False
        return self._table

    def _resize(self, rows: int) -> None:
        self._table.resize((rows, *self._table.shape[1:]), refcheck=False)
