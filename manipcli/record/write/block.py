"""Buffer of half a second of a run, and its encoding as one MCAP chunk."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from manipcli.model.state import WorldState
from manipcli.record import channels as topics
from manipcli.record.channels import Channel, ControllerChannel, Recorded, SensorChannel
from manipcli.record.messages import WORLD
from manipcli.record.selection import Selection
from manipcli.record.write.rows import (
    RowBlock,
    Template,
    Times,
    controller_state_template,
    joint_state_template,
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
_Source = tuple[str, Template, Values]
"""A topic, the template of its message, and a function of its numbers at some ticks."""

FIELDS: tuple[Interface, ...] = ("position", "velocity", "acceleration", "effort")
"""The order of the fields of a message."""


class _ControllerRows:
    """Output of a controller on the ticks of a block: `rows` (capacity, 3 + k, n) as `ControllerOutput.rows`, NaN while
    it is inactive."""

    def __init__(self, channel: ControllerChannel, robot: RobotModel, capacity: int) -> None:
        self.rows = np.zeros((capacity, REFERENCE_ROWS + len(channel.interfaces), len(channel.joints)))
        self._outputs = [REFERENCE_ROWS + channel.interfaces.index(f) for f in FIELDS if f in channel.interfaces]
        self._columns = robot.indices(channel.joints)
        self._endless = np.array([robot.joint(name).type == "continuous" for name in channel.joints], dtype=bool)

    def state(self, at: Ticks, position: Array, velocity: Array, effort: Array) -> list[Array]:
        """Numbers of the controller state at some ticks, from measured joints (T, n)."""
        rows = self.rows[at]
        feedback, speed, force = (a[:, self._columns] for a in (position, velocity, effort))
        outputs = [rows[:, k] for k in self._outputs]
        errors = self.errors(at, position, velocity)
        return [*self.reference(at), rows[:, 2], feedback, speed, force, *errors, *outputs]

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


@dataclass(slots=True)
class _Group:
    """The messages of every `stride`-th tick; `values` are functions of their numbers at some ticks."""

    stride: int
    rows: RowBlock
    values: list[Values]
    written: int = 0

    def fill(self, ticks: Times, times: Times) -> Places:
        """Encode its messages of a block; returns their ticks."""
        picked = np.flatnonzero(ticks % self.stride == 0)
        at: Ticks = slice(0, len(ticks)) if self.stride == 1 else picked
        self.rows.fill(times[picked], self.written + 1, [run for values in self.values for run in values(at)])
        self.written += len(picked)
        return picked


class Block:
    """Buffer for `capacity` ticks; `channels`: recorded channels."""

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene,
        controllers: Sequence[Recorded],
        channels: Sequence[Channel],
        selection: Selection,
        period: float,
        capacity: int,
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
        self._seen: tuple[Array, Sequence[ControllerOutput | None]] | None = None
        self._compiled: Run | None = None
        self._ids = {channel.topic: channel.id for channel in channels}
        sources = self._sources(robot, scene, controllers)
        strides = [selection.stride(topic, period) for topic, _, _ in sources]
        self._groups = []
        for stride in sorted(set(strides)):
            mine = [source for source, every in zip(sources, strides, strict=True) if every == stride]
            rows = RowBlock([template for _, template, _ in mine], capacity)
            self._groups.append(_Group(stride, rows, [values for _, _, values in mine]))

    def _sources(self, robot: RobotModel, scene: Scene, controllers: Sequence[Recorded]) -> list[_Source]:
        """All periodic messages; allocates the buffers of the controllers."""
        frames = [(joint.parent, joint.child) for joint in robot.moving_joints]
        frames += [(WORLD, body.name) for body in scene.movable]
        ids = self._ids
        states: list[_Source] = []
        readings: list[_Source] = []
        plots: list[_Source] = []
        for c in controllers:
            if isinstance(c, ControllerChannel):
                of = _ControllerRows(c, robot, self.capacity)
                self._rows.append(of.rows)
                if c.state_topic in ids:
                    template = controller_state_template(ids[c.state_topic], c.joints, c.interfaces)
                    states.append((c.state_topic, template, partial(self._state, of)))
                curves: list[tuple[str, Values]] = [
                    (c.reference_topic, of.reference),
                    (c.error_topic, partial(self._errors, of)),
                ]
                for topic, values in curves:
                    if topic in ids:
                        plots.append((topic, joint_state_template(ids[topic], c.joints, effort=False), values))
            elif isinstance(c, SensorChannel):
                template = sensor_template(ids.get(c.topic, 0), c.frame, c.width)
                room = np.zeros((self.capacity, 1, c.width))
                self._rows.append(room)
                if c.topic in ids:
                    readings.append((c.topic, template, partial(_reading, room)))
            else:
                self._rows.append(None)
        found: list[_Source] = []
        if topics.JOINT_STATES in ids:
            template = joint_state_template(ids[topics.JOINT_STATES], robot.joint_names, effort=True)
            found.append((topics.JOINT_STATES, template, self._measured))
        if topics.TF in ids:
            found.append((topics.TF, tf_template(ids[topics.TF], frames), self._frames))
        found += [*states, *readings, *plots]
        if self._actuators.names and topics.ACTUATOR_STATES in ids:
            template = joint_state_template(ids[topics.ACTUATOR_STATES], self._actuators.names, effort=True)
            found.append((topics.ACTUATOR_STATES, template, lambda at: self._actuators.state(*self._measured(at))))
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
        for rows, output in zip(self._rows, outputs, strict=True):
            if rows is not None:
                rows[k] = np.nan if output is None else output.rows

    def _look(self, numbers: Array, outputs: Sequence[ControllerOutput | None]) -> None:
        """Bind the compiled copy to these arrays, which are overwritten at every tick."""
        self._seen = numbers, outputs
        groups = [self._numbers, numbers]
        for rows, output in zip(self._rows, outputs, strict=True):
            if rows is not None and rows[0].size:
                groups += [rows, np.full(rows[0].shape, np.nan) if output is None else output.rows]
        self._compiled = bind("rows", 0, *groups)

    def encode(self, singles: Sequence[Single]) -> ChunkContent | None:
        """Encode and empty the block, with `singles` after the tick of their time. None if empty."""
        T, self.count = self.count, 0
        ticks = self._ticks[:T]
        times = np.rint(ticks * self._period * 1e9).astype(np.int64)
        picked = [group.fill(ticks, times) for group in self._groups]
        if not singles and not any(map(len, picked)):
            return None
        return self._join(times, picked, sorted(singles, key=lambda single: single.ns))

    def _measured(self, at: Ticks) -> list[Array]:
        return [self._states.position[at], self._states.velocity[at], self._states.effort[at]]

    def _frames(self, at: Ticks) -> list[Array]:
        X_position, X_quat = relative_batch(self._robot, self._states.position[at])
        links = np.concatenate((X_position, X_quat), axis=2)
        bodies = np.concatenate((self._states.body_position[at], self._states.body_quat_xyzw[at]), axis=2)
        return [*links.swapaxes(0, 1), *bodies.swapaxes(0, 1)]

    def _state(self, of: _ControllerRows, at: Ticks) -> list[Array]:
        return of.state(at, *self._measured(at))

    def _errors(self, of: _ControllerRows, at: Ticks) -> list[Array]:
        return of.errors(at, *self._measured(at)[:2])

    def _join(self, times: Times, picked: Sequence[Places], singles: Sequence[Single]) -> ChunkContent:
        """Rows and singles in time order, and the offset of each message.

        A tick has the rows of its groups, the most frequent first, then the singles up to the next tick.
        """
        T = len(times)
        ns = np.array([single.ns for single in singles], dtype=np.int64)
        lengths = np.array([len(single.record) for single in singles], dtype=np.int64)
        behind = np.searchsorted(times, ns, side="right")  # ticks before each single
        before = np.zeros(T + 1, dtype=np.int64)  # bytes before each tick, and before the end
        for group, ticks in zip(self._groups, picked, strict=True):
            before[1:] += np.bincount(ticks, minlength=T).cumsum() * group.rows.size if T else 0
        single_at = before[behind] + lengths.cumsum() - lengths
        before += np.bincount(behind, weights=lengths, minlength=T + 1).cumsum().astype(np.int64)

        indexes: dict[int, Index] = {}
        parts: list[tuple[int, bytes | memoryview]] = []
        within = np.zeros(T, dtype=np.int64)  # bytes of a tick so far
        for group, ticks in zip(self._groups, picked, strict=True):
            at = before[ticks] + within[ticks]
            within[ticks] += group.rows.size
            if len(ticks):
                # Adjacent rows are one part.
                breaks = np.flatnonzero(np.diff(at) != group.rows.size) + 1
                for first, end in pairwise([0, *breaks.tolist(), len(ticks)]):
                    parts.append((int(at[first]), group.rows.bytes[first:end].data))
                starts = zip(group.rows.channels, group.rows.starts, strict=True)
                indexes |= {i: _index(times[ticks], at + start) for i, start in starts}
        channels = np.array([single.channel for single in singles], dtype=np.int64)
        for i in sorted(set(channels.tolist())):
            indexes[i] = _index(ns[channels == i], single_at[channels == i])
        parts += zip(single_at.tolist(), (single.record for single in singles), strict=True)
        parts.sort(key=itemgetter(0))
        stamps = np.concatenate([times[ticks] for ticks in picked] + [ns])
        data = b"".join([part for _, part in parts])
        return ChunkContent(data, int(stamps.min()), int(stamps.max()), indexes)


def _reading(room: Array, at: Ticks) -> list[Array]:
    return [room[at, 0]]


def _index(times: Times, offsets: Places) -> Index:
    index = np.empty((len(times), 2), dtype=np.uint64)
    index[:, 0], index[:, 1] = times, offsets
    return index
