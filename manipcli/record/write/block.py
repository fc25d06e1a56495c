"""Buffer of half a second of a run, and its encoding as one MCAP chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from operator import itemgetter

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import Run, bind
from manipcli.control.controller import REFERENCE_ROWS, ControllerOutput
from manipcli.core.geometry import Array, wrapped
from manipcli.model.batch_kinematics import relative_batch
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState, joint_positions
from manipcli.record import channels as topics
from manipcli.record.channels import (
    Channel,
    ControllerChannel,
    MeasuredChannel,
    Recorded,
    SensorChannel,
    believed_frame,
)
from manipcli.record.messages import WORLD
from manipcli.record.selection import Selection
from manipcli.record.write.arrivals import Arrivals, nanoseconds, together
from manipcli.record.write.rows import (
    RowBlock,
    Rows,
    Template,
    Times,
    controller_state_template,
    joint_state_template,
    scene_joints_template,
    sensor_template,
    tf_template,
)
from manipcli.scene.scene import Scene
from manipcli.spec.controllers import Interface

Index = npt.NDArray[np.uint64]
Places = npt.NDArray[np.intp]
Ticks = slice | Places
"""Rows of a block."""


@dataclass(frozen=True, slots=True)
class Single:
    """A message of variable size that waits for its chunk; `record` is its whole MCAP message record."""

    ns: int
    channel: int
    record: bytes


@dataclass(frozen=True, slots=True)
class ChunkContent:
    """Message records in time order; `indexes`: channel id -> (messages, 2) of log time and offset."""

    data: bytes
    start_ns: int
    end_ns: int
    indexes: dict[int, Index]


Values = Callable[[Ticks], list[Array]]


@dataclass(frozen=True, slots=True)
class _Source:
    """Messages of a topic, and a function of their numbers at some ticks; `controller`: index of the controller that
    writes them while it is active, None for messages of every tick."""

    topic: str
    template: Template
    values: Values
    controller: int | None = None


_Idle = tuple[int, frozenset[int]]
"""Indices of the inactive controllers from a row of a block on."""
_NOBODY: list[_Idle] = [(0, frozenset())]
FIELDS: tuple[Interface, ...] = ("position", "velocity", "acceleration", "effort")
"""The order of the fields of a message."""


class _ControllerRows:
    """Output of a controller on the ticks of a block: `rows` (capacity, 3 + k, n) as `ControllerOutput.rows`; rows
    of ticks at which it is inactive have no meaning."""

    def __init__(self, channel: ControllerChannel, robot: RobotModel, capacity: int) -> None:
        self.rows = np.zeros((capacity, REFERENCE_ROWS + len(channel.interfaces), len(channel.joints)))
        self.speeds = np.ones((capacity, 1))
        self._outputs = [REFERENCE_ROWS + channel.interfaces.index(f) for f in FIELDS if f in channel.interfaces]
        self._columns = robot.indices(channel.joints)
        self._endless = np.array([robot.joint(name).type == "continuous" for name in channel.joints], dtype=bool)

    def state(self, at: Ticks, position: Array, velocity: Array, effort: Array) -> list[Array]:
        """Numbers of the controller state at some ticks, from measured joints (T, n)."""
        rows = self.rows[at]
        feedback, speed, force = (a[:, self._columns] for a in (position, velocity, effort))
        outputs = [rows[:, k] for k in self._outputs]
        errors = self.errors(at, position, velocity)
        return [*self.reference(at), rows[:, 2], feedback, speed, force, *errors, *outputs, self.speeds[at]]

    def reference(self, at: Ticks) -> list[Array]:
        """Reference positions and velocities."""
        rows = self.rows[at]
        return [rows[:, 0], rows[:, 1]]

    def errors(self, at: Ticks, position: Array, velocity: Array) -> list[Array]:
        """Reference minus measurement."""
        reference, reference_speed = self.reference(at)
        error = reference - position[:, self._columns]
        # The error of a continuous joint is the shorter rotation.
        error[:, self._endless] = wrapped(error[:, self._endless])
        return [error, reference_speed - velocity[:, self._columns]]


class _Group:
    """The messages of every `stride`-th tick."""

    def __init__(self, stride: int, sources: Sequence[_Source], capacity: int) -> None:
        self._stride = stride
        self._rows = RowBlock([source.template for source in sources], capacity)
        self._values = [source.values for source in sources]
        self._controllers = [source.controller for source in sources]
        self._written = np.zeros(len(sources), dtype=np.int64)

    def fill(self, ticks: Times, times: Times, idle: Sequence[_Idle]) -> Iterator[Rows]:
        """Encode its messages of a block."""
        picked = np.flatnonzero(ticks % self._stride == 0)
        if not len(picked):
            return
        at: Ticks = slice(0, len(ticks)) if self._stride == 1 else picked
        there = np.ones((len(self._controllers), len(picked)), dtype=bool)
        changes: list[int] = []
        if idle != _NOBODY:
            for first, controllers in idle:
                there[:, picked >= first] = [[own not in controllers] for own in self._controllers]
            changes = (np.flatnonzero((there[:, 1:] != there[:, :-1]).any(axis=0)) + 1).tolist()
        numbers = self._written[:, None] + there.cumsum(axis=1)
        self._rows.fill(times[picked], numbers, [run for values in self._values for run in values(at)])
        self._written = numbers[:, -1]
        for first, end in pairwise([0, *changes, len(picked)]):
            kept = np.flatnonzero(there[:, first]).tolist()
            if kept:
                yield Rows(picked[first:end], *self._rows.part(first, end, kept))


class Block:
    """Buffer for `capacity` ticks.

    Args:
        channels: recorded channels.
        sensors: those of numbers.
        believed: bodies with believed poses of their own.

    Attributes:
        topics: those with messages at ticks.
    """

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene,
        controllers: Sequence[Recorded],
        channels: Sequence[Channel],
        selection: Selection,
        period: float,
        capacity: int,
        sensors: Sequence[MeasuredChannel] = (),
        believed: Sequence[str] = (),
    ) -> None:
        n, m = len(robot.moving_joints), len(scene.movable)
        self.count = 0
        self.capacity = capacity
        self._robot = robot
        self._period = period
        self._ticks = np.zeros(capacity, dtype=np.int64)
        self._states = WorldState.room(n, m, capacity)
        self._numbers = self._states.numbers
        self._actuators = Drivetrain.of(robot)
        self._rows: list[Array | None] = []
        self._speeds: list[Array | None] = []
        self._seen: tuple[Array, Sequence[ControllerOutput | None]] | None = None
        self._compiled: Run | None = None
        self._idle = [*_NOBODY]
        self._ids = {channel.topic: channel.id for channel in channels}
        self._believed = np.zeros((capacity, 7 * len(believed)))
        self._belief: Array | None = None
        sources = self._sources(robot, scene, controllers)
        if topics.BELIEF_TF in self._ids:
            template = tf_template(self._ids[topics.BELIEF_TF], [(WORLD, believed_frame(name)) for name in believed])
            sources.append(_Source(topics.BELIEF_TF, template, self._beliefs))
        self.topics = frozenset(source.topic for source in sources)
        strides = [selection.stride(source.topic, period) for source in sources]
        self._groups = []
        for stride in sorted(set(strides)):
            mine = [source for source, every in zip(sources, strides, strict=True) if every == stride]
            self._groups.append(_Group(stride, mine, capacity))
        self._measured = np.zeros((capacity, max((s.first + s.width for s in sensors if s.width), default=0)))
        self._sensed: Array | None = None
        self._arrivals = [Arrivals(same, self._ids, capacity) for same in together(sensors, self._ids)]

    def attach(self, numbers: Array) -> None:
        """Copy these numbers (width of all sensors) at every tick from now on; see `MeasuredChannel`."""
        self._sensed = numbers if self._measured.shape[1] else None
        self._seen = None

    def believe(self, poses: Array) -> None:
        """Copy these believed poses (k, 7) at every tick from now on."""
        self._belief = poses.reshape(-1)
        self._seen = None

    def _sources(self, robot: RobotModel, scene: Scene, controllers: Sequence[Recorded]) -> list[_Source]:
        """All periodic messages; allocates the buffers of the controllers."""
        frames = [(joint.parent, joint.child) for joint in robot.moving_joints]
        frames += [(WORLD, body.name) for body in scene.movable]
        ids = self._ids
        states: list[_Source] = []
        readings: list[_Source] = []
        plots: list[_Source] = []
        for index, c in enumerate(controllers):
            if not isinstance(c, ControllerChannel):
                self._speeds.append(None)
            if isinstance(c, ControllerChannel):
                of = _ControllerRows(c, robot, self.capacity)
                self._rows.append(of.rows)
                self._speeds.append(of.speeds)
                if c.state_topic in ids:
                    template = controller_state_template(ids[c.state_topic], c.joints, c.interfaces)
                    states.append(_Source(c.state_topic, template, partial(self._state, of), index))
                curves: list[tuple[str, Values]] = [
                    (c.reference_topic, of.reference),
                    (c.error_topic, partial(self._errors, of)),
                ]
                for topic, values in curves:
                    if topic in ids:
                        template = joint_state_template(ids[topic], c.joints, effort=False)
                        plots.append(_Source(topic, template, values, index))
            elif isinstance(c, SensorChannel):
                template = sensor_template(ids.get(c.topic, 0), c.frame, c.width)
                room = np.zeros((self.capacity, 1, c.width))
                self._rows.append(room)
                if c.topic in ids:
                    readings.append(_Source(c.topic, template, partial(_reading, room), index))
            else:
                self._rows.append(None)
        found: list[_Source] = []
        if topics.JOINT_STATES in ids:
            template = joint_state_template(ids[topics.JOINT_STATES], robot.joint_names, effort=True)
            found.append(_Source(topics.JOINT_STATES, template, self._joints))
        if topics.TF in ids:
            found.append(_Source(topics.TF, tf_template(ids[topics.TF], frames), self._frames))
        if topics.SCENE_JOINTS in ids:
            template = scene_joints_template(ids[topics.SCENE_JOINTS], scene)
            found.append(_Source(topics.SCENE_JOINTS, template, partial(self._scene_joints, scene)))
        found += [*states, *readings, *plots]
        if self._actuators.names and topics.ACTUATOR_STATES in ids:
            template = joint_state_template(ids[topics.ACTUATOR_STATES], self._actuators.names, effort=True)
            actuators: Values = lambda at: self._actuators.state(*self._joints(at))  # noqa: E731
            found.append(_Source(topics.ACTUATOR_STATES, template, actuators))
        return found

    def add(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """Copy one tick; the caller can reuse its arrays. The block must not be full."""
        k = self.count
        self._ticks[k] = tick
        self.count = k + 1
        numbers = state.numbers
        seen = self._seen
        if seen is None or seen[0] is not numbers or seen[1] is not outputs:
            self._look(numbers, outputs)
        if self._compiled is not None:
            self._compiled(k)
            return
        self._numbers[k] = numbers
        if self._sensed is not None:
            self._measured[k] = self._sensed
        if self._belief is not None:
            self._believed[k] = self._belief
        for rows, speeds, output in zip(self._rows, self._speeds, outputs, strict=True):
            if rows is not None and output is not None:
                rows[k] = output.rows
                if speeds is not None:
                    speeds[k] = output.speed

    @property
    def idle(self) -> tuple[tuple[int, frozenset[int]], ...]:
        """Changes of inactive controllers since the block was emptied: their indices, from a tick on."""
        return tuple((int(self._ticks[k]), controllers) for k, controllers in self._idle[1:])

    def _look(self, numbers: Array, outputs: Sequence[ControllerOutput | None]) -> None:
        """Bind the compiled copy to these arrays, which are overwritten at every tick; note inactive controllers."""
        self._seen = numbers, outputs
        idle = frozenset(index for index, output in enumerate(outputs) if output is None)
        if idle != self._idle[-1][1]:
            self._idle.append((self.count - 1, idle))
        groups = [self._numbers, numbers]
        if self._sensed is not None:
            groups += [self._measured, self._sensed]
        if self._belief is not None:
            groups += [self._believed, self._belief]
        for rows, speeds, output in zip(self._rows, self._speeds, outputs, strict=True):
            if rows is not None and output is not None and rows[0].size:
                groups += [rows, output.rows] if speeds is None else [rows, output.rows, speeds, output.speed]
        self._compiled = bind("rows", 0, *groups)

    def encode(self, singles: Sequence[Single]) -> ChunkContent | None:
        """Encode and empty the block, with `singles` after the tick of their time. None if empty."""
        T, self.count = self.count, 0
        ticks = self._ticks[:T]
        times = nanoseconds(ticks, self._period)
        rows = [part for group in self._groups for part in group.fill(ticks, times, self._idle)]
        if self._sensed is not None:
            numbers = self._measured[:T]
            rows += [part for same in self._arrivals for part in same.fill(ticks, times, numbers, self._period)]
        self._idle = [(0, self._idle[-1][1])]
        if not singles and not rows:
            return None
        return _joined(times, rows, sorted(singles, key=lambda single: single.ns))

    def _joints(self, at: Ticks) -> list[Array]:
        return [self._states.position[at], self._states.velocity[at], self._states.effort[at]]

    def _frames(self, at: Ticks) -> list[Array]:
        X_position, X_quat = relative_batch(self._robot, self._states.position[at])
        links = np.concatenate((X_position, X_quat), axis=2)
        bodies = np.concatenate((self._states.body_position[at], self._states.body_quat_xyzw[at]), axis=2)
        return [*links.swapaxes(0, 1), *bodies.swapaxes(0, 1)]

    def _scene_joints(self, scene: Scene, at: Ticks) -> list[Array]:
        states = self._states.map(lambda a: a[at])
        return [np.stack([joint_positions(scene, states, joint) for joint in scene.joints], axis=-1)]

    def _beliefs(self, at: Ticks) -> list[Array]:
        poses = self._believed[at]
        return [*poses.reshape(len(poses), -1, 7).swapaxes(0, 1)]

    def _state(self, of: _ControllerRows, at: Ticks) -> list[Array]:
        return of.state(at, *self._joints(at))

    def _errors(self, of: _ControllerRows, at: Ticks) -> list[Array]:
        return of.errors(at, *self._joints(at)[:2])


def _joined(times: Times, rows: Sequence[Rows], singles: Sequence[Single]) -> ChunkContent:
    """Rows and singles in time order, and the offset of each message.

    A tick has its rows, the most frequent first, then the singles up to the next tick.
    """
    T = len(times)
    ns = np.array([single.ns for single in singles], dtype=np.int64)
    lengths = np.array([len(single.record) for single in singles], dtype=np.int64)
    behind = np.searchsorted(times, ns, side="right")  # ticks before each single
    before = np.zeros(T + 1, dtype=np.int64)  # bytes before each tick, and before the end
    for each in rows:
        before[1:] += np.bincount(each.ticks, minlength=T).cumsum() * each.bytes.shape[1]
    single_at = before[behind] + lengths.cumsum() - lengths
    before += np.bincount(behind, weights=lengths, minlength=T + 1).cumsum().astype(np.int64)

    indexes: dict[int, Index] = {}
    parts: list[tuple[int, bytes | memoryview]] = []
    within = np.zeros(T, dtype=np.int64)  # bytes of a tick so far
    for each in rows:
        ticks, size = each.ticks, each.bytes.shape[1]
        at = before[ticks] + within[ticks]
        within[ticks] += size
        # Adjacent rows are one part.
        breaks = np.flatnonzero(np.diff(at) != size) + 1
        for first, end in pairwise([0, *breaks.tolist(), len(ticks)]):
            parts.append((int(at[first]), each.bytes[first:end].data))
        for channel, start in zip(each.channels, each.starts, strict=True):
            index = _index(times[ticks], at + start)
            indexes[channel] = np.concatenate((indexes[channel], index)) if channel in indexes else index
    channels = np.array([single.channel for single in singles], dtype=np.int64)
    for i in sorted(set(channels.tolist())):
        indexes[i] = _index(ns[channels == i], single_at[channels == i])
    parts += zip(single_at.tolist(), (single.record for single in singles), strict=True)
    parts.sort(key=itemgetter(0))
    stamps = np.concatenate([times[each.ticks] for each in rows] + [ns])
    data = b"".join([part for _, part in parts])
    return ChunkContent(data, int(stamps.min()), int(stamps.max()), indexes)


def _reading(room: Array, at: Ticks) -> list[Array]:
    return [room[at, 0]]


def _index(times: Times, offsets: Places) -> Index:
    index = np.empty((len(times), 2), dtype=np.uint64)
    index[:, 0], index[:, 1] = times, offsets
    return index
