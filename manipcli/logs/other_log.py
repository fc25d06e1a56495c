"""Playback of a ROS 2 log of another program, from `/robot_description`, `/joint_states` and `/tf`.

Missing data is listed in the notes: joints that are not in `/joint_states` are taken from `/tf`, else shown at zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.text import did_you_mean, listed
from manipcli.description.elements import Joint
from manipcli.description.expanded import unread_description
from manipcli.description.urdf.urdf import read_parts
from manipcli.logs.mesh_search import MeshSearch
from manipcli.logs.sampled_poses import Poses, Samples, poses_at, root_of
from manipcli.logs.sensed import read_sensed
from manipcli.logs.several_robots import together
from manipcli.model.build_robot import bare_robot
from manipcli.model.robot import RobotModel
from manipcli.record import channels
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.faults import BadRecording
from manipcli.record.foreign.namespaces import TYPES, meant, namespaces
from manipcli.record.foreign.snapshot import joint_state, transforms
from manipcli.record.foreign.topics import Topics, open_topics
from manipcli.record.gaps import Gaps, common
from manipcli.record.read.chunk import singly
from manipcli.render.drawing import WORLD
from manipcli.replay.display_sampling import regular_times
from manipcli.replay.playback import Playback, gap_notes
from manipcli.scene.scene import Body, Scene


class _Log:
    """The data of a log; of several robots only that in namespace `space`, and shared topics."""

    def __init__(self, topics: Topics, space: str | None) -> None:
        self.urdf = ""
        self.joints: dict[str, Samples] = {}
        self.frames: dict[tuple[str, str], Samples] = {}
        self.start, self.end = np.inf, -np.inf
        known = meant({name: topic.type for name, topic in topics.all.items()})
        self.spaces = namespaces(known.values())
        if space is not None and space not in self.spaces:
            raise InvalidInput([_no_robot(topics.path, space, self.spaces)])
        # A single robot is shown whatever its namespace; among several, one must be chosen.
        shown = {"", space, *(self.spaces if len(self.spaces) == 1 else ())}
        wanted = {name: meaning.usual for name, meaning in known.items() if meaning.namespace in shown}
        self.unshown = [name for name in known if name not in wanted]
        there = {meaning.usual for name, meaning in known.items() if space is None or name in wanted}
        self.lacks = [name for name in TYPES if name not in there and name != channels.TF_STATIC]
        self.begin = begin = self._first(topics, wanted)
        self.gaps = self._gaps(topics, wanted)
        for topic, data, places in topics.messages(wanted):
            try:
                for ns, reader in singly(data, places):
                    self._take(wanted[topic], (ns - begin) / 1e9, reader)
            except CdrError as error:
                raise BadRecording(topics.path, f"{topic} cannot be read: {error}") from error

    def begin_at(self, begin: int) -> None:
        """Count all times from another one [ns]."""
        shift, self.begin = (self.begin - begin) / 1e9, begin
        self.start, self.end = self.start + shift, self.end + shift
        self.gaps = tuple((start + shift, end + shift) for start, end in self.gaps)
        for samples in (*self.joints.values(), *self.frames.values()):
            samples.times = [time + shift for time in samples.times]

    def _first(self, topics: Topics, wanted: Mapping[str, str]) -> int:
        """Time of the first moving data [ns]; a description can be much older."""
        moving = [topics.all[name] for name, usual in wanted.items() if usual in (channels.JOINT_STATES, channels.TF)]
        return min((topic.first for topic in moving if topic.count), default=topics.start)

    def _gaps(self, topics: Topics, wanted: Mapping[str, str]) -> Gaps:
        """Those of the joint states, and without any those of the frames."""
        for usual in (channels.JOINT_STATES, channels.TF):
            names = [name for name, meaning in wanted.items() if meaning == usual and topics.all[name].count]
            if names:
                found = topics.all[names[0]].intervals.gaps()
                return tuple(((start - self.begin) / 1e9, (end - self.begin) / 1e9) for start, end in found)
        return ()

    def _take(self, topic: str, time: float, reader: CdrReader) -> None:
        if topic == channels.ROBOT_DESCRIPTION:
            self.urdf = reader.text()
        elif topic == channels.JOINT_STATES:
            self._saw(time)
            self._joint_state(time, reader)
        else:
            if topic == channels.TF:
                self._saw(time)
            self._transforms(time, reader)

    def _saw(self, time: float) -> None:
        self.start, self.end = min(self.start, time), max(self.end, time)

    def _joint_state(self, time: float, reader: CdrReader) -> None:
        names, runs = joint_state(reader)
        whole = (run if len(run) == len(names) else [np.nan] * len(names) for run in runs)
        for name, *row in zip(names, *whole, strict=True):
            samples = self.joints.setdefault(name, Samples([], []))
            samples.times.append(time)
            samples.rows.append(row)

    def _transforms(self, time: float, reader: CdrReader) -> None:
        for parent, child, row in transforms(reader):
            samples = self.frames.setdefault((parent, child), Samples([], []))
            if samples.rows and sum(a * b for a, b in zip(row[3:], samples.rows[-1][3:], strict=True)) < 0.0:
                row[3:] = [-value for value in row[3:]]  # same rotation, in the hemisphere of the previous quaternion
            samples.times.append(time)
            samples.rows.append(row)


NOWHERE: Final = "shown at zero, position unknown"
AT_TIMES: Final = "held at the nearest known position while unknown"
FOREIGN: Final = "not written by manipcli"


def open_other(
    path: Path,
    *,
    rate: float,
    space: str | None = None,
    why: str = FOREIGN,
    package_path: Sequence[Path],
    allow_outside: bool,
) -> Playback:
    """Playback of a log of another program; see `open_playback`. `why`: why it is treated as one.

    Raises:
        InvalidInput: the file is not an MCAP file, is damaged, or has neither moving joints nor frames.
    """
    topics = open_topics(path)
    log = _Log(topics, space)
    if space is None and len(log.spaces) > 1:
        parts = {each: _Log(topics, each) for each in log.spaces}
        moving = {each: part for each, part in parts.items() if np.isfinite(part.start)}
        if moving:
            begin = min(part.begin for part in moving.values())
            for part in moving.values():
                part.begin_at(begin)
            start, end = min(part.start for part in moving.values()), max(part.end for part in moving.values())
            gaps = common(*(part.gaps for part in moving.values()))
            times = regular_times(start, end, rate, gaps)
            shown = {
                each: _playback(path, topics, part, each, times, gaps, why, package_path, allow_outside)
                for each, part in moving.items()
            }
            return together(path.name, shown)
    _check_moves(path, topics, log, space)
    times = regular_times(log.start, log.end, rate, log.gaps)
    return _playback(path, topics, log, space, times, log.gaps, why, package_path, allow_outside)


def _check_moves(path: Path, topics: Topics, log: _Log, space: str | None) -> None:
    """
    Raises:
        InvalidInput: the log, or the robot in namespace `space`, has neither joint states nor frames.
    """
    if not np.isfinite(log.start):
        subject = "the log" if space is None else f"'{space}'"
        what = f"{subject} has neither {channels.JOINT_STATES} nor {channels.TF}"
        message = f"{path.name}: nothing to show: {what}"
        hint = f"topics: {listed(sorted(topics.all)) or 'none'}; plot their numbers with `manipcli plot`"
        raise InvalidInput([Diagnostic("REPLAY002", message, hint=hint)])


def _playback(
    path: Path,
    topics: Topics,
    log: _Log,
    space: str | None,
    times: Array,
    gaps: Gaps,
    why: str,
    package_path: Sequence[Path],
    allow_outside: bool,
) -> Playback:
    """The playback of a log, or of its robot in namespace `space`, at these times (T,) [s]."""
    notes = [f"{why}: no steps, no contacts, no references and no verdict"]
    subject = "the log" if space is None else f"'{space}'"
    notes += [f"{subject} has no {name} ({TYPES[name]})" for name in log.lacks]
    notes += gap_notes(gaps)
    tree = {child: (parent, poses_at(samples, times)) for (parent, child), samples in log.frames.items()}
    robot = _robot(log.urdf, notes)
    if robot is not None:
        meshes = MeshSearch(path, package_path=package_path, allow_outside=allow_outside)
        robot = meshes.robot(_placed(robot, tree, notes))
        notes += meshes.notes
    names = robot.joint_names if robot is not None else tuple(log.joints)
    unknown: dict[str, list[str]] = {}
    columns = [_joint(name, log, robot, tree, times, unknown) for name in names]
    notes += [f"{what}: {listed(joints)}" for what, joints in unknown.items()]
    position, velocity, effort = np.moveaxis(np.array(columns).reshape(-1, len(times), 3), (2, 1), (0, 1))
    scene, p, q = _scene(robot, tree, len(times))
    return Playback(
        name=path.name,
        robot=robot,
        scene=scene,
        joint_names=names,
        times=frozen(times),
        position=frozen(position),
        velocity=frozen(velocity),
        effort=frozen(effort),
        reference=frozen(np.full_like(position, np.nan)),
        body_position=frozen(p),
        body_quat_xyzw=frozen(q),
        contacts=((),) * len(times),
        contact_times=((),) * len(times),
        lost=topics.lost,
        notes=tuple(notes),
        begin=log.begin,
        gaps=gaps,
        sensed=partial(read_sensed, path, begin=log.begin, end=float(times[-1])),
    )


def _no_robot(path: Path, space: str, spaces: Sequence[str]) -> Diagnostic:
    hint = did_you_mean(space, spaces, kind="namespaces") or "the log has at most one robot: omit --robot"
    return Diagnostic("REPLAY003", f"{path.name}: no robot in '{space}'", hint=hint)


def _robot(urdf: str, notes: list[str]) -> RobotModel | None:
    """The robot of a URDF text; None if it is invalid, with its first error added to `notes`."""
    if not urdf:
        return None
    try:
        parts = read_parts(unread_description(urdf.encode(), "robot_description"))
    except InvalidInput as error:
        notes.append(f"robot not shown: {error.findings[0].message}")
        return None
    if parts.errors:
        notes.append(f"robot not shown: {parts.errors[0].message}")
        return None
    return bare_robot(parts)


def _placed(robot: RobotModel, tree: Mapping[str, tuple[str, Poses]], notes: list[str]) -> RobotModel:
    """The robot at its base pose; a mobile robot is shown at the origin, and its surroundings move."""
    top, pose = root_of(robot.root, tree)
    if pose is None:
        return robot
    if pose.steady:
        return replace(robot, X_WB=Transform.of(xyz=pose.p[0], quat_xyzw=pose.q[0]))
    notes.append(f"the robot base moves in '{top}': poses are shown relative to '{robot.root}'")
    return robot


def _joint(
    name: str,
    log: _Log,
    robot: RobotModel | None,
    tree: Mapping[str, tuple[str, Poses]],
    times: Array,
    unknown: dict[str, list[str]],
) -> Array:
    """(T, 3) position, velocity, effort of a joint; NaN for unknown values, whose note is added to `unknown`."""
    if name in log.joints:
        found = log.joints[name].observed(times)
        lacks = np.isnan(found[:, 0])
        if lacks.all():
            unknown.setdefault(NOWHERE, []).append(name)
        elif lacks.any():
            unknown.setdefault(AT_TIMES, []).append(name)
        return found
    found = np.full((len(times), 3), np.nan)
    joint = robot.joint(name) if robot is not None else None
    if joint is not None and joint.child in tree and tree[joint.child][0] == joint.parent:
        found[:, 0] = _angle(joint, tree[joint.child][1])
        unknown.setdefault(f"taken from {channels.TF}, missing in {channels.JOINT_STATES}", []).append(name)
    elif joint is not None and joint.mimic is not None and joint.mimic.joint in log.joints:
        leader = log.joints[joint.mimic.joint].observed(times)[:, 0]
        found[:, 0] = joint.mimic.multiplier * leader + joint.mimic.offset
    else:
        unknown.setdefault(NOWHERE, []).append(name)
    return found


def _angle(joint: Joint, pose: Poses) -> Array:
    """(T,) positions of a joint from the pose of its child link in its parent: X_PC = X_PJ X_JC(position)."""
    inside = Poses(joint.X_PJ.p[None], joint.X_PJ.quat_xyzw[None]).inverse() @ pose
    if joint.type == "prismatic":
        return np.asarray(inside.p @ joint.axis)
    return np.unwrap(2.0 * np.arctan2(inside.q[:, :3] @ joint.axis, inside.q[:, 3]))


def _scene(robot: RobotModel | None, tree: Mapping[str, tuple[str, Poses]], count: int) -> tuple[Scene, Array, Array]:
    """Frames other than robot links as bodies without a shape, and their poses (T, m, 3) and (T, m, 4) xyzw."""
    links = {link.name for link in robot.links} if robot is not None else set()
    base = root_of(robot.root, tree)[1] if robot is not None else None
    back = base.inverse() if base is not None and not base.steady else None
    bodies, p, q = [], [np.zeros((count, 0, 3))], [np.zeros((count, 0, 4))]
    for frame in tree:
        _, pose = root_of(frame, tree)
        if frame in links or pose is None:
            continue
        shown = pose if back is None else back @ pose
        # A drawing already uses the names of the world and of the links.
        bodies.append(_shapeless(f"/{frame}" if frame == WORLD or frame.startswith("robot/") else frame))
        p.append(shown.p[:, None])
        q.append(shown.q[:, None])
    return Scene(tuple(bodies), (), frozen([0.0, 0.0, 0.0])), np.concatenate(p, axis=1), np.concatenate(q, axis=1)


def _shapeless(name: str) -> Body:
    return Body(
        name=name,
        kind="frame",
        geometries=(),
        mass=0.0,
        X_OI=Transform.identity(),
        inertia=frozen(np.zeros((3, 3))),
        friction=0.0,
        rolling_friction=0.0,
        spinning_friction=0.0,
        restitution=0.0,
        fixed=False,
        X_WO=Transform.identity(),
        interior=None,
        size=frozen(np.zeros(3)),
        centre=frozen(np.zeros(3)),
    )
