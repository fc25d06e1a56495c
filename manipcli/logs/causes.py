"""Why a run did not pass, and the places of its steps and expectations in the files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.logs.recorded_files import recorded_task_file
from manipcli.plan.outline import PLAN_FILE, PlanOutline
from manipcli.record.attachments import TASK
from manipcli.record.recording import Recording
from manipcli.replay.cause import Cause, Written
from manipcli.report.display_quantity import quantity
from manipcli.report.nesting import block_line
from manipcli.report.text import how_wrong
from manipcli.spec.load import load_task as load_spec
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec
from manipcli.task.task_files import finder
from manipcli.task.vocabulary import task_spec

Places = tuple[tuple[Written, ...], tuple[Written, ...]]
"""Places of the steps and of the expectations of a task."""


def causes_of(verdict: Verdict, places: Places, *, end: float | None) -> tuple[Cause, ...]:
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
            causes.append(Cause(how_wrong(step), step.text, at, written, hint, step=step.id))
            hint = ""
    causes += [Cause(block_line(block), "", block.ended, None, hint) for block in verdict.blocks_at_fault]
    for expectation, written in zip(verdict.expectations, places[1], strict=False):
        if expectation.missed and end is not None:
            title = f"expectation '{expectation.name}' {_missed(expectation)}"
            causes.append(Cause(title, expectation.text, expectation.at, written, expectation=expectation.name))
    if verdict.verdict == "failed" and verdict.ended_between:
        causes.insert(0, Cause(verdict.text, "", end))
    return tuple(causes)


def _missed(expectation: ExpectationOutcome) -> str:
    if expectation.outcome == "not_evaluated":
        return "was never evaluated"
    return f"fails by {quantity(expectation.distance, expectation.unit)}" if expectation.distance else "fails"


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
