"""Content of the page of a log or of a refused task, and the places of its steps and expectations."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.conditions.members.at_pose import SLIDE, AtPoseSpec
from manipcli.conditions.members.contact_force import ContactForceSpec
from manipcli.conditions.members.moved import UnmovedSpec
from manipcli.conditions.members.slip import SlipSpec
from manipcli.core.version import __version__
from manipcli.judge.measures.facts import run_facts
from manipcli.judge.verdict import Verdict
from manipcli.logs.causes import causes_of, log_places, task_places
from manipcli.logs.judge_log import judge_recording
from manipcli.logs.recorded_files import recorded_robot, recorded_scene, recorded_task_file
from manipcli.logs.replay import open_playback
from manipcli.record.attachments import CONTROLLERS, ROBOT, TASK
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording
from manipcli.replay.frames import Frames, clearest_time
from manipcli.replay.playback import RATE, Playback
from manipcli.report.inertials import recorded_inertials
from manipcli.report.logs.engine_choice import engine_choices
from manipcli.report.run_page import Picture, RunPage, Source
from manipcli.spec.base import Model
from manipcli.spec.condition import ExpectationSpec
from manipcli.task.task import Task

PICTURE = (640, 480)
"""Width and height of the pictures [pixel]."""
QUALITY = 82
"""Quality of the WebP files, 0 to 100."""
FRAMES = 1500
"""Most states of the replay in a page, which bounds the size of the page of a long run."""


def log_page(
    path: Path, *, meshes: Mapping[str, Path] = {}, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> RunPage:
    """The page of a log, from the log and the files of its meshes.

    Args:
        path: the log of a run, or the partial log of a killed run.
        meshes, package_path, allow_outside: see `open_playback`.

    Raises:
        InvalidInput: the file is not a log of manipcli, or is damaged.
    """
    recording = open_recording(path)
    if not any(len(span.states.time) for span in recording.spans):  # it ended before the start
        return _page(recording, path, judge_recording(recording, path), end=None)
    playback = open_playback(
        path, rate=page_rate(recording), meshes=meshes, package_path=package_path, allow_outside=allow_outside
    )
    verdict = playback.verdict
    assert verdict is not None, "a log of manipcli has a verdict"
    page = _page(recording, path, verdict, end=playback.end)
    worst = page.causes[0].at if page.causes else None
    frames = Frames(playback, size=PICTURE, captions=False)
    pictures = {step.id: _picture(frames, clearest_time(playback, step)) for step in playback.steps}
    moment = _picture(frames, worst) if worst is not None else None
    return replace(
        page,
        facts=run_facts(recording, recorded_robot(recording, path), recorded_scene(recording, path), verdict.steps),
        playback=playback,
        pictures=pictures,
        moment=moment,
        notes=playback.notes,
    )


def _page(recording: Recording, path: Path, verdict: Verdict, *, end: float | None) -> RunPage:
    """The parts of the page that need no state of the log. `end`: end of the run [s]; None if it did not start."""
    places = log_places(recording, path, verdict.steps)
    return RunPage(
        verdict=verdict,
        log=path.name,
        lost=recording.lost,
        causes=causes_of(verdict, places, end=end),
        steps=places[0],
        expectations=places[1],
        limits=tuple(
            _limit(spec, outcome.unit)
            for spec, outcome in zip(
                recorded_task_file(recording, path).spec.judged, verdict.expectations, strict=False
            )
        ),
        sources=tuple(
            Source(name, recording.attachments[name].decode("utf-8", "replace"))
            for name in (TASK, ROBOT, CONTROLLERS)
            if name in recording.attachments
        ),
        provenance=_provenance(recording, verdict, path),
        hashes=_hashes(recording, path),
    )


def refused_page(task: Task, verdict: Verdict) -> RunPage:
    """The page of a task with a step that cannot be planned: without a log, with the file as written."""
    places = task_places(task.file)
    file = Path(task.file.place().file)
    return RunPage(
        verdict=verdict,
        causes=causes_of(verdict, places, end=None),
        steps=places[0],
        expectations=places[1],
        limits=(None,) * len(verdict.expectations),
        sources=(Source(file.name, file.read_text("utf-8", "replace")),),
        provenance=(
            ("manipcli", __version__),
            ("engine", verdict.engine),
            ("seed", str(verdict.seed)),
            ("run", "nothing was run"),
        ),
    )


def page_rate(recording: Recording) -> float:
    """Sampling rate of the replay in a page [Hz], which bounds its number of states."""
    last = max((event.time for event in recording.events), default=0.0)
    return min(RATE, FRAMES / last) if last > 0.0 else RATE


def _limit(asked: ExpectationSpec, unit: str) -> float | None:
    """As `limit_of` for an expectation; None for combinations and for `never`, which have no single limit."""
    condition = asked.condition
    return None if condition.combines or asked.quantifier == "never" else limit_of(condition.body, unit)


def limit_of(spec: Model, unit: str) -> float | None:
    """The limit that a margin in `unit` is measured from, in `unit`; None if the condition states none.

    The limit is the key `within` or `below`; some conditions have a second one.
    """
    match spec:
        case SlipSpec() | UnmovedSpec() if unit == "rad":
            return spec.rotation
        case AtPoseSpec() if unit == "m":
            return spec.slide or SLIDE
        case ContactForceSpec(above=float()):
            return None  # the margin can belong to either of its two limits
    for key in ("within", "below"):
        value = getattr(spec, key, None)
        if isinstance(value, float) and value > 0.0:
            return value
    return None


def _picture(frames: Frames, time: float) -> Picture:
    from manipcli.replay.renderer import webp_bytes

    run: Playback = frames.playback
    return Picture(float(run.times[run.index(time)]), webp_bytes(frames.at(time), quality=QUALITY), PICTURE)


def _provenance(recording: Recording, verdict: Verdict, path: Path) -> tuple[tuple[str, str], ...]:
    return (
        ("log", path.name),
        *recording.metadata.get("versions", {}).items(),
        ("engine", verdict.engine),
        *engine_choices(recording.metadata),
        *recorded_inertials(recording.metadata),
        ("seed", str(verdict.seed)),
        ("control period", f"{1e3 * recording.period:g} ms"),
        ("run", recording.end.get("status", "") or "did not finish"),
    )


def _hashes(recording: Recording, path: Path) -> tuple[tuple[str, str], ...]:
    """SHA-256 of the log, its attachments and the meshes."""
    with path.open("rb") as file:
        log = hashlib.file_digest(file, "sha256").hexdigest()
    carried = {name: hashlib.sha256(data).hexdigest() for name, data in recording.attachments.items()}
    return ((path.name, log), *carried.items(), *recording.metadata.get("meshes", {}).items())
