"""Columns of all channels to one `Recording`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.state import WorldState
from manipcli.record import channels as topics
from manipcli.record.cdr import CdrError
from manipcli.record.channels import ControllerChannel
from manipcli.record.columns import Columns
from manipcli.record.contents import Contents
from manipcli.record.differences import body_velocities
from manipcli.record.faults import BadRecording
from manipcli.record.recording import ContactSnapshot, ControllerTrace, Recording, TaskEvent


def assemble(
    path: Path,
    contents: Contents,
    columns: Mapping[str, Columns],
    *,
    contacts: tuple[ContactSnapshot, ...],
    events: tuple[TaskEvent, ...],
    metadata: dict[str, dict[str, str]],
    attachments: dict[str, bytes],
    lost: str | None,
) -> Recording:
    """The recording that the parts of one file make.

    Raises:
        BadRecording: the parts contradict each other, or time runs backwards.
    """
    try:
        states = _states(contents, columns)
        controllers = tuple(
            _controller(ControllerChannel(name, joints), columns) for name, joints in contents.controllers.items()
        )
    except CdrError as error:
        raise BadRecording(path, str(error)) from error
    if lost is not None and len(states.time):
        lost = f"{lost}; recorded until t = {states.time[-1]:.3f} s"
    return Recording(
        joint_names=contents.joints,
        body_names=contents.bodies,
        states=states,
        controllers=controllers,
        contacts=contacts,
        events=events,
        metadata=metadata,
        attachments=attachments,
        lost=lost,
        period=contents.period,
    )


def _states(contents: Contents, columns: Mapping[str, Columns]) -> WorldState:
    joints, bodies = columns[topics.JOINT_STATES], columns[topics.TF]
    n, m = len(contents.joints), len(contents.bodies)
    if joints.names not in (None, contents.joints):
        raise CdrError(f"{topics.JOINT_STATES} names other joints than the metadata")
    if bodies.names not in (None, contents.bodies):
        raise CdrError(f"{topics.TF} names other bodies than the metadata")
    ns = joints.times
    if not np.array_equal(ns, bodies.times):
        raise CdrError(f"{topics.TF} and {topics.JOINT_STATES} are not of the same times")
    _check_order(topics.JOINT_STATES, ns)
    time = _seconds(ns)
    poses = np.empty((len(ns), m, 7))
    for k in range(m):
        poses[:, k] = bodies.take(k, 7)
    position, quat = _settled(poses[..., :3]), _settled(poses[..., 3:])
    linear, angular = body_velocities(time, position, quat)
    return WorldState(
        time=time,
        position=_settled(joints.take(0, n)),
        velocity=_settled(joints.take(1, n)),
        effort=_settled(joints.take(2, n)),
        body_position=position,
        body_quat_xyzw=quat,
        body_linear=_settled(linear),
        body_angular=_settled(angular),
    )


def _controller(channel: ControllerChannel, columns: Mapping[str, Columns]) -> ControllerTrace:
    found = columns[channel.state_topic]
    if found.names not in (None, channel.joints):
        raise CdrError(f"{channel.state_topic} names other joints than the metadata")
    _check_order(channel.state_topic, found.times)
    reference, speed, feedback, output = (_settled(found.take(k, len(channel.joints))) for k in range(4))
    return ControllerTrace(
        name=channel.name,
        joints=channel.joints,
        times=_seconds(found.times),
        reference_position=reference,
        reference_velocity=speed,
        position=feedback,
        output=output,
    )


def _check_order(topic: str, ns: np.ndarray[tuple[int], np.dtype[np.int64]]) -> None:
    back = np.flatnonzero(np.diff(ns) <= 0)
    if len(back):
        raise CdrError(f"time runs backwards in {topic} after t = {ns[back[0]] / 1e9:.3f} s")


def _seconds(ns: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Array:
    return _settled(ns / 1e9)


def _settled(values: Array) -> Array:
    """Contiguous and read-only."""
    array = np.ascontiguousarray(values)
    array.flags.writeable = False
    return array
