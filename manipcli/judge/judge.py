"""The verdict on a run, from its recording alone."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.state_window import ROUNDING
from manipcli.core.errors import Diagnostic
from manipcli.core.text import listed
from manipcli.judge.drawn import SAMPLE, Drawn
from manipcli.judge.examine import examine
from manipcli.judge.saturations import Saturations
from manipcli.judge.steps import ENDED, RunStatus, left_out, step_outcomes
from manipcli.judge.verdict import INTERRUPTED, ExpectationOutcome, StepOutcome, Verdict, VerdictWord, broken_at
from manipcli.model.robot import RobotModel
from manipcli.record.recording import Recording
from manipcli.scene.scene import Scene
from manipcli.spec.condition import ExpectationSpec

STORED, UNTIL = "verdict", "until"
"""Metadata of the log: the verdict when it was written, and the time [s] of the last tick that was judged."""
RUN = "run"
"""Metadata of the log: task, seed, engine, physics (`full` | `none`), period, status, and the cause of a failure."""


def judge(recording: Recording, *, expect: Sequence[ExpectationSpec], robot: RobotModel, scene: Scene) -> Verdict:
    """Judge a recording by what its task expected.

    The order of importance: a run that was interrupted, did not end or has lost its end is an `error`, whatever else is
    true of it; a step that is not done makes it `failed`, unless it was tolerated (`on_fail: continue`); so does an
    expectation that is not met, or could not be evaluated. With no expectations the steps alone decide, and the text
    says so.

    Args:
        recording: the log.
        expect: the expectations, in the order of the task in the log.
        robot, scene: built from the log's own attachments.
    """
    run = recording.metadata.get(RUN, {})
    status = run.get("status", "")
    errors = _errors(recording, status)
    steps = step_outcomes(recording, interrupted=bool(errors))
    examined = examine(
        recording,
        expect,
        robot=robot,
        scene=scene,
        seam=CONDITIONS,
        physics=run.get("physics", "") == "full",
        steps=steps,
    )
    outcomes = tuple(_unless_broken(one, recording) for one in examined.outcomes)
    errors = errors or _cut_short(recording, examined.end)
    cause = run.get("cause", "") if status == RunStatus.FAILED else _broken_after_all(recording)
    word, text = _verdict(errors, cause, steps, outcomes)
    return Verdict(
        task=run.get("task", ""),
        verdict=word,
        seed=int(run["seed"]) if run.get("seed", "").isdecimal() else 0,
        engine=run.get("engine", ""),
        simulated_time=examined.end,
        steps=steps,
        expectations=outcomes,
        errors=errors,
        text=text,
        drawn=_drawn(recording),
        cuts=Saturations.from_metadata(recording.metadata, end=examined.end, period=recording.period),
    )


def _broken_after_all(recording: Recording) -> str:
    """The watch that stopped the robot when no step was on any more; within a step, that says it itself."""
    broken = [event.text for event in recording.events if event.kind == "watch_broken" and not event.step]
    return f"stopped after the last step: {broken[0]}" if broken else ""


def _unless_broken(outcome: ExpectationOutcome, recording: Recording) -> ExpectationOutcome:
    """The same, but for a watch that ended the run between two ticks of a thinned log: on those it may seem to hold."""
    told = broken_at(outcome.name)
    broken = [event.text for event in recording.events if event.kind == "watch_broken" and event.text.startswith(told)]
    if not broken or outcome.outcome != "passed":
        return outcome
    text = f"it was broken at {broken[0].removeprefix(told)}; the log does not hold that tick"
    return ExpectationOutcome(outcome.name, "not_evaluated", None, outcome.unit, None, text)


def _drawn(recording: Recording) -> Drawn | None:
    """Which sample this was; None also where the log says what no sample is."""
    try:
        return Drawn.from_metadata(recording.metadata[SAMPLE]) if SAMPLE in recording.metadata else None
    except ValueError:
        return None


def _errors(recording: Recording, status: str) -> tuple[Diagnostic, ...]:
    """Why the recording is not that of a run which came to its end."""
    errors = []
    if status == RunStatus.INTERRUPTED:
        errors.append(Diagnostic(INTERRUPTED, "the run was interrupted"))
    elif status not in ENDED:
        what = f"status '{status}'" if status else "no status"
        errors.append(Diagnostic("RUN103", f"the run did not come to its end: the log has {what}"))
    if recording.lost is not None:
        errors.append(Diagnostic("RUN104", f"the log is incomplete: {recording.lost}"))
    elif status == RunStatus.COMPLETE and left_out(recording):
        errors.append(Diagnostic("RUN104", f"the log is incomplete: {left_out(recording)}"))
    return tuple(errors)


def _cut_short(recording: Recording, end: float) -> tuple[Diagnostic, ...]:
    """A copy without the last of its messages, though what was stored behind them is there."""
    try:
        until = float(recording.metadata.get(STORED, {}).get(UNTIL, ""))
    except ValueError:
        return ()
    if until - end > ROUNDING:
        return (Diagnostic("RUN104", f"the log is incomplete: it ends at {end:.3f} s, and the run at {until:.3f} s"),)
    return ()


def _verdict(
    errors: tuple[Diagnostic, ...],
    cause: str,
    steps: tuple[StepOutcome, ...],
    expectations: tuple[ExpectationOutcome, ...],
) -> tuple[VerdictWord, str]:
    """The word, and in one line why. `cause`: what ended the simulation, in a step, before the first or after all."""
    if errors:
        return "error", errors[0].message
    if cause and not any(step.went_wrong for step in steps):
        return "failed", cause
    undone = next((step for step in steps if step.outcome != "done" and not step.tolerated), None)
    if undone is not None:
        why = f": {undone.text}" if undone.text else ""
        first = undone.attempts[0].text if undone.attempts else ""
        if first not in ("", undone.text):
            why += f" (the first attempt: {first})"
        return "failed", f"step '{undone.id}' {undone.outcome.replace('_', ' ')}{why}"
    if not steps:
        return "failed", "the recording knows no steps"
    unmet = next((one for one in expectations if one.outcome != "passed"), None)
    if unmet is not None:
        why = f": {unmet.text}" if unmet.text else ""
        return "failed", f"expectation '{unmet.name}' {unmet.outcome.replace('_', ' ')}{why}"
    done = f"all {len(steps)} steps done" if len(steps) > 1 else "its one step done"
    failed = [step.id for step in steps if step.tolerated]
    if failed:
        done = f"{len(steps) - len(failed)} of {len(steps)} steps done, the task tolerates that {listed(failed)} failed"
    if not expectations:
        return "passed", f"{done}; the task states no expectations"
    met = f"all {len(expectations)} expectations met" if len(expectations) > 1 else "its one expectation met"
    return "passed", f"{done}, {met}"
