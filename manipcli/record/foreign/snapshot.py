"""Joints and frames of any ROS 2 log at one time: the newest sample of each, from any publisher."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from manipcli.record import channels as topics
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.foreign.namespaces import TYPES, Meant, meant, namespaces
from manipcli.record.foreign.topics import Topics
from manipcli.record.read.chunk import singly


@dataclass(frozen=True, slots=True)
class JointSample:
    """Last published state of a joint; None for missing values."""

    time: float
    position: float | None
    velocity: float | None
    effort: float | None


@dataclass(frozen=True, slots=True)
class FrameSample:
    """Last published pose of a frame: x y z [m] and quaternion xyzw in `parent`."""

    time: float
    parent: str
    pose: tuple[float, ...]


@dataclass(slots=True)
class Snapshot:
    """Last samples by name; with several robots, names of joints and frames include the namespace.

    `urdf`: each /robot_description by the prefix of its joint names; `lacks`: usual topics without a message; `unread`:
    why messages are left out.
    """

    joints: dict[str, JointSample] = field(default_factory=dict)
    frames: dict[str, FrameSample] = field(default_factory=dict)
    urdf: dict[str, str] = field(default_factory=dict)
    lacks: tuple[str, ...] = ()
    unread: dict[str, None] = field(default_factory=dict)


def snapshot(log: Topics, time: float) -> Snapshot:
    """The newest samples at `time` [s of log time].

    Raises:
        BadRecording: the file cannot be read.
    """
    # Nanoseconds since 1970 have more digits than a double.
    limit = round(time * 1e9) + 512
    known = meant({name: topic.type for name, topic in log.all.items()})
    there = {known[name].usual for name, topic in log.all.items() if topic.count and name in known}
    taken = Snapshot(lacks=tuple(usual for usual in TYPES if usual not in there and usual != topics.TF_STATIC))
    several = len(namespaces(known.values())) > 1
    for name, topic in log.all.items():
        expected = TYPES.get(known[name].usual if name in known else name)
        if expected is not None and (topic.type, topic.encoding) != (expected, "cdr"):
            kind = f"{topic.type or 'an unknown type'}, {topic.encoding or 'no encoding'}"
            taken.unread[f"{name} is {kind}, not {expected} in CDR"] = None
            known.pop(name, None)
    for name, data, places in log.messages(known):
        for ns, reader in singly(data, places.at(np.flatnonzero(places.times <= limit))):
            try:
                _take(taken, known[name], several, ns, reader)
            except CdrError as error:
                taken.unread[f"a message of {name} {error}"] = None
    return taken


def _take(taken: Snapshot, topic: Meant, several: bool, ns: int, reader: CdrReader) -> None:
    time = ns / 1e9
    before = f"{topic.namespace.removeprefix('/')}/" if several and topic.namespace else ""
    if topic.usual == topics.ROBOT_DESCRIPTION:
        taken.urdf[before] = reader.text()
    elif topic.usual == topics.JOINT_STATES:
        names, values = joint_state(reader)
        for k, name in enumerate(before + joint for joint in names):
            known = taken.joints.get(name)
            if known is None or known.time <= time:
                taken.joints[name] = JointSample(time, *(run[k] if k < len(run) else None for run in values))
    else:
        for *names, pose in transforms(reader):
            # The publisher can already include the namespace.
            parent, child = (before + name.removeprefix(before) for name in names)
            known_frame = taken.frames.get(child)
            if known_frame is None or known_frame.time <= time:
                taken.frames[child] = FrameSample(time, parent, tuple(pose))


def joint_state(reader: CdrReader) -> tuple[Sequence[str], list[list[float]]]:
    """The names of a sensor_msgs/JointState, and its positions, velocities and efforts, which can be shorter."""
    reader.header()
    return reader.texts(), [[reader.f64() for _ in range(reader.count(8))] for _ in range(3)]


def transforms(reader: CdrReader) -> Iterator[tuple[str, str, list[float]]]:
    """Parent, child and pose (x y z, quaternion xyzw) of each of a tf2_msgs/TFMessage; names without a leading `/`."""
    for _ in range(reader.count(64)):
        parent, child = reader.header().lstrip("/"), reader.text().lstrip("/")
        yield parent, child, [reader.f64() for _ in range(7)]
