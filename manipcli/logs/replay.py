"""Playback of a log, from the log and the files of its meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import frozen
from manipcli.judge.margin_curves import MarginTraces
from manipcli.judge.measures.reference import references
from manipcli.judge.verdict import StepOutcome, Verdict
from manipcli.logs.causes import causes_of, log_places
from manipcli.logs.judge_log import judge_recording
from manipcli.logs.mesh_search import MeshSearch
from manipcli.logs.other_log import open_other
from manipcli.logs.recorded_files import recorded_packages, recorded_robot, recorded_scene
from manipcli.logs.sensed import read_sensed
from manipcli.record.channels import TF
from manipcli.record.faults import LEFT_OUT, Thinned
from manipcli.record.foreign.origin import is_own
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import TaskEvent
from manipcli.replay.display_sampling import sampled
from manipcli.replay.playback import RATE, Phase, Playback, PlaybackStep, gap_notes


def open_playback(
    path: Path,
    *,
    rate: float = RATE,
    space: str | None = None,
    meshes: Mapping[str, Path] = {},
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> Playback:
    """Playback of a log.

    Args:
        path: the log of a run, the partial log of a killed run, or a ROS 2 log of another program.
        rate: sampling rate of the playback [Hz].
        space: namespace of the shown robot, such as `/r1`, in a log of another program with several robots.
        meshes: mesh files of the run by URI, if known.
        package_path: folders with packages of meshes, searched before those near the log and the working directory.
        allow_outside: allow mesh files in any folder.

    Raises:
        InvalidInput: the file is not a log, is damaged, or has nothing to show.
    """
    if space is None and is_own(path):
        try:
            return _open_own(path, rate=rate, known=meshes, package_path=package_path, allow_outside=allow_outside)
        except Thinned:
            return open_other(path, rate=rate, why=LEFT_OUT, package_path=package_path, allow_outside=allow_outside)
    return open_other(path, rate=rate, space=space, package_path=package_path, allow_outside=allow_outside)


def _open_own(
    path: Path, *, rate: float, known: Mapping[str, Path], package_path: Sequence[Path], allow_outside: bool
) -> Playback:
    recording = open_recording(path)
    samples = sampled(recording, rate=rate)
    if samples is None:
        raise InvalidInput([Diagnostic("REPLAY001", f"{path.name}: no recorded state to show")])
    robot, scene = recorded_robot(recording, path), recorded_scene(recording, path)
    traces = MarginTraces(1.0 / rate)
    verdict = judge_recording(recording, path, traces=traces)
    meshes = MeshSearch(
        path,
        hashes=recording.metadata.get("meshes", {}),
        embedded=recording.embedded_meshes(),
        known=known,
        package_path=package_path,
        allow_outside=allow_outside,
        robot=recorded_packages(recording, path),
    )
    robot, scene = meshes.robot(robot), meshes.scene(scene)
    notes = meshes.notes
    span, contacts, gaps = samples
    states = span.states
    body_position, body_quat_xyzw = states.body_position, states.body_quat_xyzw
    if TF in recording.absent:
        start = [scene.body(name).X_WO for name in recording.body_names]
        body_position = frozen(np.broadcast_to([X_WO.p for X_WO in start], body_position.shape))
        body_quat_xyzw = frozen(np.broadcast_to([X_WO.quat_xyzw for X_WO in start], body_quat_xyzw.shape))
        notes = (*notes, f"{TF} not recorded: bodies are drawn at their start poses")
    notes = (*notes, *(recording.unknown(topic) for topic in recording.silent), *gap_notes(gaps))
    touching = [contact for each in contacts.found for contact in each]
    if touching and not any(contact.points for contact in touching):
        notes = (*notes, "the log has no contact points: contact forces are not drawn")
    return Playback(
        name=verdict.task or path.name,
        robot=robot,
        scene=scene,
        joint_names=recording.joint_names,
        times=states.time,
        position=states.position,
        velocity=states.velocity,
        effort=states.effort,
        reference=references(span.controllers, recording.joint_names, len(states.time)),
        body_position=body_position,
        body_quat_xyzw=body_quat_xyzw,
        contacts=tuple(contacts.found),
        contact_times=tuple(contacts.times),
        steps=playback_steps(verdict, recording.events, end=float(states.time[-1])),
        verdict=verdict,
        causes=causes_of(verdict, log_places(recording, path, verdict.steps), end=float(states.time[-1])),
        margins=traces.curves(verdict.expectations),
        events=recording.events,
        lost=recording.lost,
        notes=notes,
        gaps=gaps,
        period=recording.period,
        sensed=partial(read_sensed, path, begin=0, end=float(states.time[-1])),
        keep=meshes.folder,
    )


def playback_steps(verdict: Verdict, events: Sequence[TaskEvent], *, end: float) -> tuple[PlaybackStep, ...]:
    """The started steps; a step that did not end gets the end `end` [s]."""
    begun = [step for step in verdict.steps if step.started is not None]
    return tuple(_step(step, events, end) for step in sorted(begun, key=lambda step: step.started or 0.0))


def _step(step: StepOutcome, events: Sequence[TaskEvent], end: float) -> PlaybackStep:
    start, last = step.started or 0.0, end if step.ended is None else step.ended
    begins = [(event.text, event.time) for event in events if event.kind == "phase_started" and event.step == step.id]
    return PlaybackStep(
        id=step.id,
        verb=step.verb,
        label=step.label,
        start=start,
        end=last,
        outcome=step.outcome,
        text=step.text,
        phases=tuple(Phase(a, begin, stop) for (a, begin), (_, stop) in pairwise([*begins, ("", last)])),
    )
