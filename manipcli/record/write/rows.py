"""Encoding of fixed-size messages in blocks: one row of bytes per tick, in which only the numbers change.

Names are constant during a run, so every message of a channel has the same length and each number has a fixed offset.
All such messages of one tick, with their MCAP message records, form one row. A block of T rows is an array
(T, row size) of bytes with the constant parts already filled in; a numpy structured view writes one field of all T
rows at once.

    message record:  opcode u8 | length u64 | channel u16 | sequence u32 | log time u64 | publish time u64 | CDR bytes
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.record.cdr import NS_PER_S, CdrWriter
from manipcli.record.encode import encode
from manipcli.record.records import MESSAGE, MESSAGE_HEAD
from manipcli.scene.scene import Scene
from manipcli.spec.controllers import Interface

Times = npt.NDArray[np.int64]
Field = npt.NDArray[np.number]


def message_record(channel: int, sequence: int, ns: int, data: bytes) -> bytes:
    """One MCAP message record; log time and publish time are both `ns`."""
    return MESSAGE_HEAD.pack(MESSAGE, 22 + len(data), channel, sequence, ns, ns) + data


@dataclass(frozen=True, slots=True)
class Template:
    """A message with zeros as numbers.

    Attributes:
        channel: its channel.
        data: the message.
        stamps: offsets of its times.
        runs: (offset, count) of its numbers.
        codes: numpy types of the runs; empty: all are doubles.
    """

    channel: int
    data: bytes
    stamps: tuple[int, ...]
    runs: tuple[tuple[int, int], ...]
    codes: tuple[str, ...] = ()


def scene_joints_template(channel: int, scene: Scene) -> Template:
    """sensor_msgs/JointState; run: the positions of the joints of the scene."""
    return joint_state_template(channel, [joint.name for joint in scene.joints], effort=False, velocity=False)


def joint_state_template(channel: int, joints: Sequence[str], *, effort: bool, velocity: bool = True) -> Template:
    """sensor_msgs/JointState; runs: position and, if wanted, velocity and effort."""
    writer = CdrWriter()
    stamp = writer.header(0, "")
    writer.texts(joints)
    n = len(joints)
    runs = [(writer.doubles(n), n)]
    for wanted in (velocity, effort):
        offset = writer.doubles(n if wanted else 0)
        if wanted:
            runs.append((offset, n))
    return Template(channel=channel, data=writer.data, stamps=(stamp,), runs=tuple(runs))


def tf_template(channel: int, frames: Sequence[tuple[str, str]]) -> Template:
    """tf2_msgs/TFMessage of (parent, child); a run of 7 for each: x y z, quaternion xyzw."""
    writer = CdrWriter()
    writer.u32(len(frames))
    stamps, runs = [], []
    for parent, child in frames:
        stamps.append(writer.header(0, parent))
        writer.text(child)
        runs.append((writer.f64s([0.0] * 7), 7))
    return Template(channel=channel, data=writer.data, stamps=tuple(stamps), runs=tuple(runs))


def controller_state_template(channel: int, joints: Sequence[str], interfaces: Sequence[Interface]) -> Template:
    """control_msgs/JointTrajectoryControllerState.

    Runs: reference position, velocity, acceleration; feedback position, velocity, effort; error position, velocity;
    output, one run per interface, in the order of their fields: position, velocity, acceleration, effort; the speed.
    """
    n = len(joints)
    writer = CdrWriter()
    stamp = writer.header(0, "")
    writer.texts(joints)
    output = "".join(interface[0] for interface in interfaces)
    runs = []
    for fields in ("pva", "pve", "pv", output):
        for field in "pvae":
            offset = writer.doubles(n if field in fields else 0)
            if field in fields:
                runs.append((offset, n))
        writer.time(0)
    writer.u32(0)
    for _ in range(4):
        for _ in range(3):
            writer.u32(0)
        writer.time(0)
    runs.append((writer.f64(1.0), 1))
    return Template(channel=channel, data=writer.data, stamps=(stamp,), runs=tuple(runs))


def sensor_template(channel: int, frame: str, width: int) -> Template:
    """A message of a header and `width` float64 fields, such as geometry_msgs/WrenchStamped: one run of them."""
    writer = CdrWriter()
    stamp = writer.header(0, frame)
    offset = writer.f64s([0.0] * width)
    return Template(channel=channel, data=writer.data, stamps=(stamp,), runs=((offset, width),))


def measured_template(
    channel: int, kind: str, filled: Sequence[str], fixed: Mapping[str, object], frame: str
) -> Template:
    """A message of a sensor: fields that are `filled` at every measurement, those `fixed`, and its frame."""
    message = encode(kind, fixed, frame=frame, filled=filled)
    runs = tuple((run.offset, run.count) for run in message.runs)
    stamps = (message.stamp,) if message.stamp >= 0 else ()
    return Template(channel, message.data, stamps, runs, tuple(run.code for run in message.runs))


@dataclass(frozen=True, slots=True)
class Rows:
    """Messages of some ticks of a block, the same on each tick.

    Attributes:
        ticks: (n,) rows of the block.
        bytes: (n, size) the messages of each tick.
        channels, starts: channel of each message and its offset in a row.
    """

    ticks: npt.NDArray[np.intp]
    bytes: npt.NDArray[np.uint8]
    channels: tuple[int, ...]
    starts: tuple[int, ...]


class RowBlock:
    """Up to `capacity` rows of the messages of `templates`, in that order.

    Attributes:
        channels: channel of each message in a row.
        starts: offset of each message in a row.
        size: size of a row [byte].
        bytes: (capacity, size) the rows.
    """

    def __init__(self, templates: Sequence[Template], capacity: int) -> None:
        self.channels = tuple(template.channel for template in templates)
        constant = [message_record(template.channel, 0, 0, template.data) for template in templates]
        ends = tuple(accumulate(len(record) for record in constant))
        self.starts = (0, *ends[:-1])[: len(templates)]
        self.size = ends[-1] if ends else 0
        self.bytes = np.tile(np.frombuffer(b"".join(constant), dtype=np.uint8), (capacity, 1))
        self._sequences: list[Field] = []
        self._times: list[Field] = []
        self._stamps: list[tuple[Field, Field]] = []
        self._runs: list[Field] = []
        for template, start in zip(templates, self.starts, strict=True):
            self._sequences.append(self._field("<u4", start + 11))
            self._times += [self._field("<u8", start + 15), self._field("<u8", start + 23)]
            payload = start + MESSAGE_HEAD.size
            for stamp in template.stamps:
                self._stamps.append((self._field("<i4", payload + stamp), self._field("<u4", payload + stamp + 4)))
            codes = template.codes or ("<f8",) * len(template.runs)
            for (offset, count), code in zip(template.runs, codes, strict=True):
                self._runs.append(self._field(f"({count},){code}", payload + offset))

    def _field(self, code: str, offset: int) -> Field:
        """A view of one field of all rows."""
        layout = np.dtype({"names": ["field"], "formats": [code], "offsets": [offset], "itemsize": self.size})
        view: Field = self.bytes.view(layout)[:, 0]["field"]
        return view

    def fill(
        self, times_ns: Times, sequences: Times, values: Sequence[Array], *, stamps_ns: Times | None = None
    ) -> None:
        """Write the first T rows: times (T,), sequence numbers (messages, T), and one array (T, count) for every run
        of every template, in order. `stamps_ns`: of the headers, if they are not the times."""
        T = len(times_ns)
        for field, sequence in zip(self._sequences, sequences, strict=True):
            field[:T] = sequence
        for field in self._times:
            field[:T] = times_ns
        sec, nanosec = np.divmod(times_ns if stamps_ns is None else stamps_ns, NS_PER_S)
        for sec_field, nanosec_field in self._stamps:
            sec_field[:T] = sec
            nanosec_field[:T] = nanosec
        for field, value in zip(self._runs, values, strict=True):
            field[:T] = value

    def part(
        self, first: int, end: int, messages: Sequence[int]
    ) -> tuple[npt.NDArray[np.uint8], tuple[int, ...], tuple[int, ...]]:
        """Some messages of the rows [first, end): bytes (n, size), channel of each message, its offset in a row."""
        channels = tuple(self.channels[k] for k in messages)
        rows = self.bytes[first:end]
        if len(messages) == len(self.channels):
            return rows, channels, self.starts
        ends = (*self.starts[1:], self.size)
        pieces = [rows[:, self.starts[k] : ends[k]] for k in messages]
        starts = tuple(accumulate((piece.shape[1] for piece in pieces[:-1]), initial=0))
        return np.concatenate(pieces, axis=1), channels, starts
