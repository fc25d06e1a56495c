"""Half a second of a run in numbers, and its encoding as the content of one MCAP chunk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.control.controller import REFERENCE_ROWS, ControllerOutput
from manipcli.core.geometry import Array
from manipcli.model.batch_kinematics import relative_batch
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.record import channels as topics
from manipcli.record.channels import Channel, ControllerChannel, Recorded, WrenchChannel
from manipcli.record.messages import WORLD
from manipcli.record.rows import (
    RowBlock,
    Times,
    controller_state_template,
    joint_state_template,
    tf_template,
    wrench_template,
)
from manipcli.spec.controllers import Interface

PLOT_PERIOD = 0.01
"""[s] between two messages of the topics that only serve viewers (reference, error, actuators)."""

Index = npt.NDArray[np.uint64]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Single:
    """A message of its own size that waits for its chunk; `record`: the whole MCAP message record."""

    ns: int
    channel: int
    record: bytes


@dataclass(frozen=True, slots=True)
class ChunkContent:
    """Message records in the order of time; `indexes`: channel id -> (messages, 2) of log time and offset."""

    data: bytes
    start_ns: int
    end_ns: int
    indexes: dict[int, Index]


FIELDS: tuple[Interface, ...] = ("position", "velocity", "acceleration", "effort")
"""The order of the fields of a message."""


class _ControllerRows:
    """What one controller put out on the ticks of a block: `rows` (capacity, 3 + k, n), as `ControllerOutput.rows`; NaN
    where it was not active."""

    def __init__(self, channel: ControllerChannel, robot: RobotModel, capacity: int) -> None:
        self.rows = np.zeros((capacity, REFERENCE_ROWS + len(channel.interfaces), len(channel.joints)))
        self._outputs = [REFERENCE_ROWS + channel.interfaces.index(f) for f in FIELDS if f in channel.interfaces]
        self._columns = robot.indices(channel.joints)
        self._endless = np.array([robot.joint(name).type == "continuous" for name in channel.joints], dtype=bool)

    def values(self, position: Array, velocity: Array, effort: Array) -> tuple[list[Array], list[Array]]:
        """Numbers of the controller's messages from all measured joints (T, n): of its state, and of its plots."""
        rows = self.rows[: len(position)]
        feedback, speed, force = (a[:, self._columns] for a in (position, velocity, effort))
        reference, reference_speed, acceleration = rows[:, 0], rows[:, 1], rows[:, 2]
        error = reference - feedback
        # A joint without limits errs the short way round.
        error[:, self._endless] = np.remainder(error[:, self._endless] + np.pi, 2 * np.pi) - np.pi
        errors = [error, reference_speed - speed]
        outputs = [rows[:, k] for k in self._outputs]
        state = [reference, reference_speed, acceleration, feedback, speed, force, *errors, *outputs]
        return state, [reference, reference_speed, *errors]


class Block:
    """Room for `capacity` ticks. `ids`: topic -> channel id."""

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene,
        controllers: Sequence[Recorded],
        channels: Sequence[Channel],
        period: float,
        capacity: int,
    ) -> None:
        ids = {channel.topic: channel.id for channel in channels}
        joints, bodies = robot.moving_joints, scene.movable
        n, m = len(joints), len(bodies)
        self.count = 0
        self.capacity = capacity
        self._robot = robot
        self._period = period
        self._stride = max(1, round(PLOT_PERIOD / period))
        self._ticks = np.zeros(capacity, dtype=np.int64)
        self._position, self._velocity, self._effort = (np.zeros((capacity, n)) for _ in range(3))
        self._body_position, self._body_quat = np.zeros((capacity, m, 3)), np.zeros((capacity, m, 4))
        claiming = [c for c in controllers if isinstance(c, ControllerChannel)]
        sensing = [c for c in controllers if isinstance(c, WrenchChannel)]
        self._controllers = [_ControllerRows(controller, robot, capacity) for controller in claiming]
        self._wrenches = [np.zeros((capacity, 1, 6)) for _ in sensing]
        rows = iter([*(of.rows for of in self._controllers)])
        wrenches = iter(self._wrenches)
        self._rows: list[Array | None] = [
            next(rows) if isinstance(c, ControllerChannel) else None if c is None else next(wrenches)
            for c in controllers
        ]
        frames = [(joint.parent, joint.child) for joint in joints] + [(WORLD, body.name) for body in bodies]
        states = [controller_state_template(ids[c.state_topic], c.joints, c.interfaces) for c in claiming]
        states += [wrench_template(ids[c.topic], c.link) for c in sensing]
        self._actuators = Drivetrain.of(robot)
        plots = [
            joint_state_template(ids[topic], c.joints, effort=False)
            for c in claiming
            for topic in (c.reference_topic, c.error_topic)
        ]
        if self._actuators.names:
            turned = joint_state_template(ids[topics.ACTUATOR_STATES], self._actuators.names, effort=True)
            plots.append(turned)
        measured = joint_state_template(ids[topics.JOINT_STATES], robot.joint_names, effort=True)
        self._fast = RowBlock([measured, tf_template(ids[topics.TF], frames), *states], capacity)
        self._slow = RowBlock(plots, capacity)
        self._fast_written = 0
        self._slow_written = 0

    def add(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """Copies one tick; the caller may reuse its arrays. The block must not be full."""
        k = self.count
        self._ticks[k] = tick
        self._position[k] = state.position
        self._velocity[k] = state.velocity
        self._effort[k] = state.effort
        self._body_position[k] = state.body_position
        self._body_quat[k] = state.body_quat_xyzw
        for rows, output in zip(self._rows, outputs, strict=True):
            if rows is not None:
                rows[k] = np.nan if output is None else output.rows
        self.count = k + 1

    def encode(self, singles: Sequence[Single]) -> ChunkContent | None:
        """Everything in the block, and `singles` behind the tick of their time; empties the block. None when empty."""
        T, self.count = self.count, 0
        if T == 0 and not singles:
            return None
        times = np.rint(self._ticks[:T] * self._period * 1e9).astype(np.int64)
        plotted = np.flatnonzero(self._ticks[:T] % self._stride == 0)
        self._fill(T, times, plotted)
        return self._join(times, plotted, sorted(singles, key=lambda single: single.ns))

    def _fill(self, T: int, times: Times, plotted: Places) -> None:
        position, velocity, effort = self._position[:T], self._velocity[:T], self._effort[:T]
        X_position, X_quat = relative_batch(self._robot, position)
        links = np.concatenate((X_position, X_quat), axis=2)
        bodies = np.concatenate((self._body_position[:T], self._body_quat[:T]), axis=2)
        fast = [position, velocity, effort, *links.swapaxes(0, 1), *bodies.swapaxes(0, 1)]
        slow: list[Array] = []
        for rows in self._controllers:
            state, plots = rows.values(position, velocity, effort)
            fast += state
            slow += [values[plotted] for values in plots]
        fast += [wrenches[:T, 0] for wrenches in self._wrenches]
        if self._actuators.names:
            slow += self._actuators.state(position[plotted], velocity[plotted], effort[plotted])
        self._fast.fill(times, self._fast_written + 1, fast)
        self._slow.fill(times[plotted], self._slow_written + 1, slow)
        self._fast_written += T
        self._slow_written += len(plotted)

    def _join(self, times: Times, plotted: Places, singles: Sequence[Single]) -> ChunkContent:
        """Rows and singles in the order of time, and where each message stands.

        A tick's row is followed by its row for plots, where it has one, and then by the singles up to the next tick.
        """
        T, fast, slow = len(times), self._fast.size, self._slow.size
        ns = np.array([single.ns for single in singles], dtype=np.int64)
        lengths = np.array([len(single.record) for single in singles], dtype=np.int64)
        behind = np.searchsorted(times, ns, side="right")  # rows before each single
        single_bytes = np.bincount(behind, weights=lengths, minlength=T + 1).cumsum().astype(np.int64)
        k = np.arange(T)
        row_at = k * fast + np.searchsorted(plotted, k) * slow + single_bytes[:T]
        single_at = behind * fast + np.searchsorted(plotted, behind) * slow + lengths.cumsum() - lengths

        indexes: dict[int, Index] = {}
        for rows, when, at in ((self._fast, times, row_at), (self._slow, times[plotted], row_at[plotted] + fast)):
            if len(when):
                indexes |= {i: _index(when, at + start) for i, start in zip(rows.channels, rows.starts, strict=True)}
        channels = np.array([single.channel for single in singles], dtype=np.int64)
        for i in sorted(set(channels.tolist())):
            indexes[i] = _index(ns[channels == i], single_at[channels == i])

        cuts = sorted({0, T, *(plotted + 1).tolist(), *behind.tolist()})
        waiting = iter(singles)
        parts: list[bytes | memoryview] = []
        plot_row = dict(zip((plotted + 1).tolist(), range(len(plotted)), strict=True))
        number = np.bincount(behind, minlength=T + 1)
        start = 0
        for cut in cuts:
            parts.append(self._fast.bytes[start:cut].data)
            if cut in plot_row:
                parts.append(self._slow.bytes[plot_row[cut]].data)
            parts += [next(waiting).record for _ in range(number[cut])]
            start = cut
        stamps = np.concatenate((times, ns))
        return ChunkContent(b"".join(parts), int(stamps.min()), int(stamps.max()), indexes)


def _index(times: Times, offsets: Places) -> Index:
    index = np.empty((len(times), 2), dtype=np.uint64)
    index[:, 0], index[:, 1] = times, offsets
    return index
