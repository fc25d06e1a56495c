"""State in a log at one time, also in logs of other programs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from manipcli.conditions.state_window import ROUNDING
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Array, Transform
from manipcli.judge.measures.reference import references
from manipcli.judge.steps import step_outcomes
from manipcli.logs.recorded_files import recorded_robot
from manipcli.model.kinematics import Kinematics
from manipcli.record.attachments import URDF
from manipcli.record.channels import CONTACTS, EVENTS, TF
from manipcli.record.contents import RECORD
from manipcli.record.faults import LEFT_OUT, BadRecording, Thinned
from manipcli.record.foreign.field_units import joint_units
from manipcli.record.foreign.snapshot import snapshot
from manipcli.record.foreign.topics import Topics, open_topics
from manipcli.record.messages import WORLD
from manipcli.record.read.excerpt import open_excerpt
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import ContactSnapshot, Recording, Span, TaskEvent
from manipcli.report.logs.snapshot import JointMoment, Moment, PoseMoment


def moment(path: Path, time: float) -> Moment:
    """The state in a log at `time` [s from its beginning].

    Raises:
        InvalidInput: the file is not a log, is damaged, or ends before `time`.
    """
    excerpt = open_excerpt(path, time) if time >= 0.0 else None
    if excerpt is not None and time <= excerpt.duration + ROUNDING:
        # Without an answer in the excerpt, all is read.
        with contextlib.suppress(BadRecording, Thinned):
            return _ours(path, time, excerpt.recording, excerpt.end)
    found = open_topics(path, damaged=True)
    if not 0.0 <= time <= found.duration + ROUNDING:
        message = f"{time:g} s is outside the log {path.name}, which is 0 s to {found.duration:.3f} s"
        raise InvalidInput([Diagnostic("LOG110", message)])
    if RECORD not in found.metadata:
        return _others(path, found, time, why="not written by manipcli")
    try:
        return _ours(path, time, open_recording(path))
    except Thinned:
        return _others(path, found, time, why=LEFT_OUT)


def step_ends(path: Path) -> dict[str, float]:
    """End [s] of each step of a log: one tick before the next step starts, or the end of the log.

    Raises:
        InvalidInput: the file is not a log, or is damaged.
    """
    end = open_topics(path, damaged=True).duration
    try:
        recording = open_recording(path)
    except BadRecording:  # not written by manipcli: no steps
        return {}
    return {
        step.id: end if step.ended is None else max(step.started, round(step.ended - recording.period, 9))
        for step in step_outcomes(recording, interrupted=False)
        if step.started is not None
    }


def _ours(path: Path, time: float, recording: Recording, last: float | None = None) -> Moment:
    """`last`: time of the last state [s], if the spans of the recording end before."""
    missing = [] if recording.lost is None else [recording.lost]
    missing += [recording.unknown(topic) for topic in (TF, CONTACTS, EVENTS) if recording.unknown(topic)]
    span, k, touched, end = _at(recording.spans, time)
    if span is None:
        raise InvalidInput([Diagnostic("LOG111", f"{path.name} has no state before {time:g} s")])
    states = span.states
    now = float(states.time[k])
    wanted = references(span.controllers, recording.joint_names, len(states.time))[k]
    units = joint_units(recording.attachments.get(URDF, b""))
    joints = tuple(
        JointMoment(
            name,
            units.get(name, ""),
            float(states.position[k, j]),
            float(states.velocity[k, j]),
            float(states.effort[k, j]),
            None if np.isnan(wanted[j]) else float(wanted[j]),
        )
        for j, name in enumerate(recording.joint_names)
    )
    poses = tuple(
        PoseMoment(
            name,
            WORLD,
            _pose(states.body_position[k, j], states.body_quat_xyzw[k, j]),
            float(np.linalg.norm(states.body_linear[k, j])),
        )
        for j, name in enumerate(recording.body_names)
        if TF not in recording.absent
    )
    step, phase = active(recording.events, time)
    return Moment(
        log=str(path),
        asked=time,
        time=now,
        end=end if last is None else last,
        step="" if step is None else step.step,
        verb="" if step is None else step.verb,
        phase=phase,
        joints=joints,
        poses=poses,
        contacts=None if recording.unknown(CONTACTS) else touched.contacts if touched is not None else (),
        missing=tuple(missing),
        tool=_tool(recording, path, states.position[k], states.velocity[k]),
        contacts_time=None if touched is None else touched.time,
    )


def _tool(recording: Recording, path: Path, q: Array, v: Array) -> PoseMoment | None:
    """Pose and speed of the tool frame at joint positions `q` and velocities `v` (n); None without its files."""
    try:
        robot = recorded_robot(recording, path)
    except InvalidInput:
        return None
    if robot.tool is None or not (np.isfinite(q).all() and np.isfinite(v).all()):
        return None
    link, X_LT = robot.tool.link, robot.tool.X_LT
    kinematics = Kinematics(robot)
    speed = float(np.linalg.norm(kinematics.point_velocity(q, v, link, X_LT)))
    return PoseMoment("tool", WORLD, kinematics.forward(q, link) @ X_LT, speed)


def _at(spans: Iterable[Span], time: float) -> tuple[Span | None, int, ContactSnapshot | None, float]:
    """The span with the last state until `time`, the row of that state, its recorded contacts, and the end of the log
    [s]."""
    chosen, k, end = None, 0, 0.0
    touched: ContactSnapshot | None = None
    for span in spans:
        if not len(span.states.time):
            continue
        end = float(span.states.time[-1])
        if span.states.time[0] > time + ROUNDING:
            continue
        chosen = span
        k = int(np.searchsorted(span.states.time, time + ROUNDING, side="right")) - 1
        for change in span.contacts:
            if change.time <= time + ROUNDING:
                touched = change
    return chosen, k, touched, end


def active(events: Iterable[TaskEvent], time: float) -> tuple[TaskEvent | None, str]:
    """The start event of the step that is active at `time` [s], and its phase; None between steps."""
    step: TaskEvent | None = None
    phase = ""
    for event in events:
        if event.time > time + ROUNDING:
            break
        if event.kind == "step_started":
            step, phase = event, ""
        elif event.kind == "phase_started":
            phase = event.text
        elif event.kind == "step_ended":
            step, phase = None, ""
    return step, phase


def _others(path: Path, found: Topics, time: float, *, why: str) -> Moment:
    start = found.start / 1e9
    taken = snapshot(found, start + time)
    missing = [f"the log has no {topic}" for topic in taken.lacks]
    missing += [f"{why}: no steps, references and contacts", *taken.unread]
    units = {
        before + name: unit for before, urdf in taken.urdf.items() for name, unit in joint_units(urdf.encode()).items()
    }
    newest = [sample.time for sample in taken.joints.values()] + [sample.time for sample in taken.frames.values()]
    return Moment(
        log=str(path),
        asked=time,
        time=max(newest, default=start) - start,
        end=found.duration,
        step="",
        verb="",
        phase="",
        joints=tuple(
            JointMoment(name, units.get(name, ""), sample.position, sample.velocity, sample.effort)
            for name, sample in taken.joints.items()
        ),
        poses=tuple(
            PoseMoment(name, sample.parent, _pose(sample.pose[:3], sample.pose[3:]))
            for name, sample in taken.frames.items()
        ),
        contacts=None,
        missing=(*found.faults, *missing),
        ours=False,
    )


def _pose(position: npt.ArrayLike, quat_xyzw: npt.ArrayLike) -> Transform:
    """A pose; other programs write quaternions of zeros for the identity."""
    return Transform.of(xyz=position, quat_xyzw=quat_xyzw if np.any(quat_xyzw) else None)
