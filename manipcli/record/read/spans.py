"""Spans of a recording, read from its file chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np
import numpy.typing as npt

from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array
from manipcli.model.state import WorldState
from manipcli.record import channels as topics
from manipcli.record import schemas
from manipcli.record.cdr import CdrError
from manipcli.record.channels import ControllerChannel, believed_frame
from manipcli.record.contents import Contents
from manipcli.record.decode import Int
from manipcli.record.faults import Thinned
from manipcli.record.messages import WORLD
from manipcli.record.read.chunk import Places, chunk_places, open_chunk, sequences, singly
from manipcli.record.read.columns import (
    Columns,
    body_runs,
    controller_state_runs,
    joint_state_runs,
)
from manipcli.record.read.contacts import read_contacts
from manipcli.record.read.differences import body_velocities
from manipcli.record.read.scan import Record, chunk_at, guarded, readable
from manipcli.record.read.sensed import SensedTopics, reading_topics
from manipcli.record.recording import ContactSnapshot, ControllerTrace, Recording, Span
from manipcli.record.selection import common_stride

MEASURED: Final = 2
"""Place of the measured positions among the runs of a controller state."""
_NEVER: Final = 2**63 - 1


@dataclass(frozen=True, slots=True)
class FileSpans:
    """Iterable of the spans in a file, with at most three in memory.

    Attributes:
        path: the file.
        contents: declared contents.
        channels: channel id -> topic.
        chunks: offsets of its chunks.
        cut: whether parts of the file are missing, so that messages of some ticks can be missing.
        points: whether contacts have contact points.
        skip_points: leave these out.
        sensors: whose readings are read.
    """

    path: Path
    contents: Contents
    channels: Mapping[int, str]
    chunks: tuple[int, ...]
    cut: bool
    points: bool
    skip_points: bool = False
    sensors: Mapping[str, Sensed] = field(default_factory=dict)

    def __iter__(self) -> Iterator[Span]:
        """
        Raises:
            BadRecording: a chunk is damaged, parts are inconsistent, or time runs backwards.
        """
        before: Span | None = None
        span: Span | None = None
        for after in self._without_velocities():
            if span is not None:
                yield _with_velocities(before, span, after)
            before, span = span, after
        assert span is not None, "at least one span"
        yield _with_velocities(before, span, None)

    def _without_velocities(self) -> Iterator[Span]:
        reader = _SpanReader(
            self.contents, self.channels, self.sensors, gaps=self.cut, points=self.points, skip=self.skip_points
        )
        empty = True
        with readable(self.path), self.path.open("rb") as file:
            for start in self.chunks:
                span = self._chunk(file, start, reader)
                if span is not None:
                    empty = False
                    yield span
        if reader.waiting and not self.cut:
            raise Thinned(self.path)
        if empty:
            yield reader.span(0)

    def _chunk(self, file: BinaryIO, start: int, reader: _SpanReader) -> Span | None:
        chunk, indexes = chunk_at(self.path, file, start)

        def read(record: Record) -> Span | None:
            data = open_chunk(self.path, record)
            reader.add(data, chunk_places(data, indexes))
            ready = reader.ready
            return reader.span(ready) if ready else None

        try:
            return guarded(self.path, chunk, read)
        except _Apart as error:
            raise Thinned(self.path) from error


def with_readings(recording: Recording, sensors: Mapping[str, Sensed]) -> Recording:
    """The recording with the readings of these sensors in its spans, if the log has their topics."""
    spans = recording.spans
    if not sensors or not isinstance(spans, FileSpans):
        return recording
    there = {*spans.channels.values()}
    read = {name: sensed for name, sensed in sensors.items() if there.issuperset(reading_topics(name, sensed))}
    return replace(recording, spans=replace(spans, sensors=read), sensors=tuple(read))


class _Apart(Exception):
    """Joints, bodies and controllers have different times or rates than declared, or contacts or measurements are
    missing."""


@dataclass(frozen=True, slots=True)
class _Inactive:
    """When a controller is inactive: (k, 2) starts and ends [ns]; and the places of its joints."""

    intervals: Int
    joints: list[int]

    @staticmethod
    def of(contents: Contents, controller: ControllerChannel) -> _Inactive:
        intervals = [
            (round(start * 1e9), _NEVER if end is None else round(end * 1e9))
            for start, end in contents.inactive[controller.name]
        ]
        joints = [contents.joints.index(name) for name in controller.joints]
        return _Inactive(np.array(intervals, dtype=np.int64).reshape(-1, 2), joints)

    def active(self, ns: Int) -> npt.NDArray[np.bool_]:
        """Whether the controller is active at these times [ns]."""
        starts, ends = self.intervals.T
        begun, over = (np.searchsorted(times, ns, side="right") for times in (starts, ends))
        return np.equal(begun, over)


class _SpanReader:
    """Collects the messages of successive chunks into complete ticks.

    `gaps`: ticks can be missing; `points`: contacts have contact points, and `skip` leaves these out.
    """

    def __init__(
        self,
        contents: Contents,
        channels: Mapping[int, str],
        sensors: Mapping[str, Sensed],
        *,
        gaps: bool,
        points: bool,
        skip: bool,
    ) -> None:
        n, m = len(contents.joints), len(contents.bodies)
        self._channels = channels
        everyone = [ControllerChannel(name, joints) for name, joints in contents.controllers.items()]
        self._controllers = [controller for controller in everyone if controller.state_topic not in contents.absent]
        self._inactive = {
            controller.state_topic: _Inactive.of(contents, controller)
            for controller in self._controllers
            if controller.name in contents.inactive
        }
        self._bodies = m
        self._columns = {
            topics.JOINT_STATES: Columns(
                topics.JOINT_STATES, schemas.JOINT_STATE, joint_state_runs, contents.joints, (n,) * 3
            )
        }
        if topics.TF not in contents.absent:
            poses = body_runs(frozenset(contents.bodies), WORLD)
            self._columns[topics.TF] = Columns(topics.TF, schemas.TF_MESSAGE, poses, contents.bodies, (7,) * m)
        if contents.believed and topics.BELIEF_TF not in contents.absent:
            frames = tuple(map(believed_frame, contents.believed))
            poses = body_runs(frozenset(frames), WORLD)
            self._columns[topics.BELIEF_TF] = Columns(
                topics.BELIEF_TF, schemas.TF_MESSAGE, poses, frames, (7,) * len(frames)
            )
        for controller in self._controllers:
            topic, widths = controller.state_topic, (len(controller.joints),) * 4
            self._columns[topic] = Columns(
                topic, schemas.CONTROLLER_STATE, controller_state_runs, controller.joints, widths
            )
        strides = {topic: contents.strides.get(topic, 1) for topic in self._columns}
        self._grid_ns = common_stride(strides) * contents.period * 1e9
        self._strided = len(set(strides.values())) > 1
        self._contacts: list[ContactSnapshot] = []
        self._sensors = {name: SensedTopics(name, sensed) for name, sensed in sensors.items()}
        self._sensed = {
            topic: self._sensors[name] for name, sensed in sensors.items() for topic in reading_topics(name, sensed)
        }
        self._gaps = gaps
        self._points, self._skip = points, skip
        self._last = -1
        self._numbers: dict[str, int] = {}

    @property
    def ready(self) -> int:
        """Number of complete ticks."""
        ready = min(len(columns) for topic, columns in self._columns.items() if topic not in self._inactive)
        for topic, inactive in self._inactive.items():
            needed = inactive.active(self._columns[topics.JOINT_STATES].times[:ready]).cumsum()
            ready = int(np.searchsorted(needed, len(self._columns[topic]), side="right"))
        return ready

    @property
    def waiting(self) -> bool:
        """Whether there are messages of an incomplete tick."""
        return any(len(columns) for columns in self._columns.values())

    def add(self, data: bytes, places: Mapping[int, Places]) -> None:
        for channel, found in places.items():
            if channel not in self._channels:
                raise CdrError(f"a message of channel {channel}, which is not declared")
            topic = self._channels[channel]
            if topic in self._columns:
                common = self._common(found) if self._strided else found
                if len(common.times):
                    self._columns[topic].add(data, common)
            elif topic == topics.CONTACTS:
                self._follow(topic, sequences(data, found))
                self._contacts += [
                    ContactSnapshot(ns / 1e9, read_contacts(reader, points=self._points, skip=self._skip))
                    for ns, reader in singly(data, found)
                ]
            elif topic in self._sensed:
                self._follow(topic, sequences(data, found))
                self._sensed[topic].add(topic, data, found)

    def _follow(self, topic: str, numbers: Int) -> None:
        """Detect missing messages by their sequence numbers, which another program can restart at 0 or set to 0."""
        before = self._numbers.get(topic, min(int(numbers[0]) - 1, 0))
        if not self._gaps and numbers.any() and not np.all(np.diff(numbers, prepend=before) == 1):
            raise _Apart
        self._numbers[topic] = int(numbers[-1])

    def _common(self, places: Places) -> Places:
        """The messages of the ticks with a message of every topic."""
        ticks = np.rint(places.times / self._grid_ns) * self._grid_ns
        on = np.abs(places.times - ticks) < 1.0  # [ns] rounding error
        return Places(places.times[on], places.starts[on], places.lengths[on])

    def span(self, ticks: int) -> Span:
        """The next `ticks`, with zero body velocities; with 0 ticks, all contacts."""
        ns, (position, velocity, effort) = self._columns[topics.JOINT_STATES].take(ticks)
        if topics.TF in self._columns:
            body_ns, poses = self._columns[topics.TF].take(ticks)
        else:
            body_ns, poses = ns, [np.full((ticks, 7), np.nan)] * self._bodies
        taken = [self._trace(controller.state_topic, ns, position) for controller in self._controllers]
        if not np.array_equal(ns, body_ns):
            raise _Apart
        believed = np.zeros((0, 0, 7))
        if topics.BELIEF_TF in self._columns:
            belief_ns, beliefs = self._columns[topics.BELIEF_TF].take(ticks)
            believed = np.stack(beliefs, axis=1)
            if not np.array_equal(ns, belief_ns):
                raise _Apart
        self._count(ns)
        time = _settled(ns / 1e9)
        bodies = np.stack(poses, axis=1) if poses else np.zeros((ticks, 0, 7))
        zeros = np.zeros_like(bodies[..., :3])
        states = WorldState(time, position, velocity, effort, bodies[..., :3], bodies[..., 3:], zeros, zeros)
        return Span(
            states=states.map(_settled),
            controllers=tuple(
                ControllerTrace(controller.name, controller.joints, time, *map(_settled, runs))
                for controller, runs in zip(self._controllers, taken, strict=True)
            ),
            contacts=self._contacts_until(time[-1] if ticks else np.inf),
            believed=_settled(believed),
            readings={name: each.until(float(ns[-1]) if ticks else np.inf) for name, each in self._sensors.items()},
        )

    def _trace(self, topic: str, ns: Int, position: Array) -> list[Array]:
        """The numbers of a controller at the ticks `ns`; NaN where it is inactive, except for its measured joints."""
        columns, inactive = self._columns[topic], self._inactive.get(topic)
        if inactive is None:
            times, runs = columns.take(len(ns))
        else:
            active = inactive.active(ns)
            times, found = columns.take(int(active.sum()))
            ns = ns[active]
            runs = [np.full((len(active), run.shape[1]), np.nan) for run in found]
            runs[MEASURED][:] = position[:, inactive.joints]
            if len(times) == len(ns):
                for run, values in zip(runs, found, strict=True):
                    run[active] = values
        if not np.array_equal(ns, times):
            raise _Apart
        return runs

    def _count(self, ns: Int) -> None:
        """Check that ticks start at 0 without gaps."""
        ticks = np.concatenate(([self._last], np.rint(ns / self._grid_ns).astype(np.int64)))
        if not self._gaps and not np.all(np.diff(ticks) == 1):
            raise _Apart
        self._last = int(ticks[-1])

    def _contacts_until(self, time: float) -> tuple[ContactSnapshot, ...]:
        now = tuple(snapshot for snapshot in self._contacts if snapshot.time <= time)
        self._contacts = [snapshot for snapshot in self._contacts if snapshot.time > time]
        return now


def _with_velocities(before: Span | None, span: Span, after: Span | None) -> Span:
    """The span with body velocities, computed with the adjacent ticks."""
    near = [span.states]
    if before is not None:
        near.insert(0, before.states.map(lambda a: a[-1:]))
    if after is not None:
        near.append(after.states.map(lambda a: a[:1]))
    linear, angular = body_velocities(
        np.concatenate([states.time for states in near]),
        np.concatenate([states.body_position for states in near]),
        np.concatenate([states.body_quat_xyzw for states in near]),
    )
    first = 0 if before is None else 1
    mine = slice(first, first + len(span.states.time))
    states = replace(span.states, body_linear=_settled(linear[mine]), body_angular=_settled(angular[mine]))
    return replace(span, states=states)


def _settled(values: Array) -> Array:
    """Contiguous and read-only."""
    array = np.ascontiguousarray(values)
    array.flags.writeable = False
    return array
