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
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.logs.judge_log import judge_recording
from manipcli.logs.recorded_files import recorded_robot, recorded_scene, recorded_task_file
from manipcli.logs.replay import open_playback
from manipcli.plan.outline import PLAN_FILE, PlanOutline
from manipcli.record.attachments import CONTROLLERS, ROBOT, TASK
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Recording
from manipcli.replay.frames import Frames, clearest_time
from manipcli.replay.playback import RATE, Playback
from manipcli.report.display_quantity import quantity
from manipcli.report.inertials import recorded_inertials
from manipcli.report.logs.engine_choice import engine_choices
from manipcli.report.nesting import block_line
from manipcli.report.run_page import Cause, Picture, RunPage, Source, Written
from manipcli.report.text import how_wrong
from manipcli.spec.base import Model
from manipcli.spec.condition import ExpectationSpec
from manipcli.spec.load import load_task as load_spec
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec
from manipcli.task.task import Task
from manipcli.task.task_files import finder
from manipcli.task.vocabulary import task_spec

PICTURE = (640, 480)
"""Width and height of the pictures [pixel]."""
QUALITY = 82
"""Quality of the WebP files, 0 to 100."""
FRAMES = 1500
"""Most states of the replay in a page, which bounds the size of the page of a long run."""

Places = tuple[tuple[Written, ...], tuple[Written, ...]]
"""Places of the steps and of the expectations of a task."""


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
        causes=_causes(verdict, places, end=end),
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
        causes=_causes(verdict, places, end=None),
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


def log_places(recording: Recording, path: Path, outcomes: Sequence[StepOutcome]) -> Places:
    """Where steps and expectations are written according to the log, and their lines in the resolved task.

    The steps are those of `outcomes`, since a log without its plan knows only the started steps.
    """
    task = recorded_task_file(recording, path)
    known, judged = _known_places(recording)

    def written(place: str, *key: str | int) -> Written:
        return Written(place.rpartition(":")[0], TASK, task.place(*key).line)

    numbers = {str(step.id): k for k, step in enumerate(task.spec.steps)}
    steps = tuple(
        written(known.get(outcome.id, ""), "steps", numbers[outcome.id]) if outcome.id in numbers else Written("")
        for outcome in outcomes
    )
    keys = task.spec.judged_at
    return steps, tuple(written(judged[k] if len(judged) == len(keys) else "", *key) for k, key in enumerate(keys))


def task_places(task: Located[TaskSpec]) -> Places:
    """Where steps and expectations are written in a task file."""

    def written(*key: str | int) -> Written:
        place = task.place(*key)
        name = Path(place.file).name
        return Written(f"{name}:{place.line}", name, place.line) if place.line > 0 else Written("")

    steps = tuple(written("steps", k) for k in range(len(task.spec.steps)))
    return steps, tuple(written(*key) for key in task.spec.judged_at)


def file_places(path: Path, overrides: Sequence[str]) -> Places:
    """As `task_places`, from the path of a task file.

    Raises:
        InvalidInput: the file is invalid.
    """
    return task_places(load_spec(path, model=task_spec(), overrides=overrides, find=finder(path, allow_outside=True)))


def _known_places(recording: Recording) -> tuple[dict[str, str], list[str]]:
    """Places such as `pour.yaml:21:5`: of steps by id (without a plan, of started steps), and of expectations and
    watches (empty without a plan)."""
    places = {event.step: event.place for event in recording.events if event.place}
    plan = PlanOutline.read(recording.attachments.get(PLAN_FILE))
    return places | {step.id: step.place for step in plan.steps if step.place}, list(plan.judged)


def page_rate(recording: Recording) -> float:
    """Sampling rate of the replay in a page [Hz], which bounds its number of states."""
    last = max((event.time for event in recording.events), default=0.0)
    return min(RATE, FRAMES / last) if last > 0.0 else RATE


def _causes(verdict: Verdict, places: Places, *, end: float | None) -> tuple[Cause, ...]:
    """Errors, then failed steps, then unmet expectations. `end`: end of the run [s]; None if nothing was run."""
    if verdict.verdict == "passed":
        return ()
    hint = next((finding.hint for finding in verdict.errors if finding.hint), None) or ""
    causes = []
    if verdict.verdict == "error":
        causes = [Cause(finding.message, "", end, hint=finding.hint or "") for finding in verdict.errors]
        hint = ""
    for step, written in zip(verdict.steps, places[0], strict=False):
        if step.went_wrong:
            at = None if end is None else step.ended if step.ended is not None else end
            causes.append(Cause(how_wrong(step), step.text, at, written, hint))
            hint = ""
    causes += [Cause(block_line(block), "", block.ended, None, hint) for block in verdict.blocks_at_fault]
    for expectation, written in zip(verdict.expectations, places[1], strict=False):
        if expectation.missed and end is not None:
            title = f"expectation '{expectation.name}' {_missed(expectation)}"
            causes.append(Cause(title, expectation.text, expectation.at, written))
    if verdict.verdict == "failed" and verdict.ended_between:
        causes.insert(0, Cause(verdict.text, "", end))
    return tuple(causes)


def _missed(expectation: ExpectationOutcome) -> str:
    if expectation.outcome == "not_evaluated":
        return "was never evaluated"
    return f"fails by {quantity(expectation.distance, expectation.unit)}" if expectation.distance else "fails"


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
