"""A log read back: the only witness that judge, replay and report know.

What is small is there at once; what grows with time comes span by span, so that an hour is judged in the memory of a
minute. `read_recording` makes a recording that holds everything, `open_recording` one that reads spans from its file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from manipcli.core.geometry import Array
from manipcli.model.state import Contact, WorldState


@dataclass(frozen=True, slots=True)
class TaskEvent:
    """`kind`: step_started, step_ended, phase_started, goal_sent, goal_ended, ...; `place`: file:line of the step."""

    time: float
    kind: str
    step: str
    verb: str
    outcome: str
    text: str
    place: str


@dataclass(frozen=True, slots=True)
class ControllerTrace:
    """What one controller did: arrays (T, n) on the control ticks."""

    name: str
    joints: tuple[str, ...]
    times: Array
    reference_position: Array
    reference_velocity: Array
    position: Array
    output: Array

    def map(self, change: Callable[[Array], Array]) -> ControllerTrace:
        """The same with every array changed."""
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
    """Successive control ticks at which everything is recorded that states and traces are made of.

    `states` have a leading time axis T, each controller's trace is on the same ticks; and the changes of contacts among
    them.
    """

    states: WorldState
    controllers: tuple[ControllerTrace, ...]
    contacts: tuple[ContactSnapshot, ...]


EMBEDDED = "embedded_meshes"
"""Name of the metadata record that says which attachment holds which mesh: URI -> name of the attachment."""


@dataclass(frozen=True, slots=True)
class Recording:
    """Everything in one log.

    Attributes:
        joint_names, body_names: the order of the arrays of states.
        spans: at least one; each follows the one before without a gap. May be gone through as often as one likes;
            where they come from a file, that reads it again.
        events: what happened in the task.
        metadata: name -> key -> value.
        attachments: name -> bytes.
        lost: why the end is missing, or None.
        period: [s] of a tick.
        absent: topics that the task told not to record. States whose topic is absent are NaN, and a controller whose
            state is absent has no trace.
        silent: topics of which there is no message, though a run always records some: another program left them out, or
            the run ended before.

    `states`, `controllers` and `contacts` are those of all spans together: ask them of a recording that is `whole`.
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

    def embedded_meshes(self) -> dict[str, bytes]:
        """The mesh files that the log carries, by the URI that its URDF and its scene call them by; empty unless the
        run was told to embed them. The material libraries of OBJ files are among them, beside their meshes."""
        names = self.metadata.get(EMBEDDED, {})
        return {uri: self.attachments[name] for uri, name in names.items() if name in self.attachments}

    def unknown(self, topic: str) -> str:
        """Why nothing is known of what a topic tells; "" where it is known."""
        if topic in self.absent:
            return f"the run did not record {topic}"
        return f"the log holds no message of {topic}" if topic in self.silent else ""

    def whole(self) -> Recording:
        """The same with all ticks in one span in memory: some 1.2 kB a tick for an arm with a hand and two objects."""
        return replace(self, spans=(self._span(),))

    @property
    def states(self) -> WorldState:
        """The states of all control ticks, from 0."""
        return self._span().states

    @property
    def controllers(self) -> tuple[ControllerTrace, ...]:
        """What each controller did on all ticks."""
        return self._span().controllers

    @property
    def contacts(self) -> tuple[ContactSnapshot, ...]:
        """Every change of contacts."""
        return self._span().contacts

    def _span(self) -> Span:
        match self.spans:
            case (Span() as only,):
                return only
        return joined(self.spans)


def joined(spans: Iterable[Span]) -> Span:
    """At least one span, as one; each is let go of before the next is asked for."""
    iterator = iter(spans)
    first = next(iterator)
    following = next(iterator, None)
    if following is None:
        return first
    tables = [_Growing(array) for array in _arrays(first)]
    contacts = [*first.contacts]
    while following is not None:
        for table, array in zip(tables, _arrays(following), strict=True):
            table.append(array)
        contacts += following.contacts
        following = next(iterator, None)
    arrays = (table.take() for table in tables)
    return Span(
        states=first.states.map(lambda _: next(arrays)),
        controllers=tuple(trace.map(lambda _: next(arrays)) for trace in first.controllers),
        contacts=tuple(contacts),
    )


def _arrays(span: Span) -> list[Array]:
    """Every array of a span, states first, in the order of `map`."""
    found: list[Array] = []

    def keep(array: Array) -> Array:
        found.append(array)
        return array

    span.states.map(keep)
    for trace in span.controllers:
        found += trace.arrays
    return found


class _Growing:
    """A table that grows by rows, by a quarter and in place: a long recording is held once, where a list of parts and
    their concatenation would hold it twice."""

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
