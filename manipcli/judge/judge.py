"""The verdict on a run, from its recording alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf

from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.sensed import NO_SENSORS, Sensed
from manipcli.conditions.state_window import ROUNDING
from manipcli.core.errors import Diagnostic
from manipcli.core.text import listed
from manipcli.judge.drawn import SAMPLE, Drawn
from manipcli.judge.evaluate import examine
from manipcli.judge.margin_curves import MarginTraces
from manipcli.judge.outside import not_asked, of_part, unless_outside
from manipcli.judge.part import PART, RunPart
from manipcli.judge.saturations import Saturations
from manipcli.judge.steps import ENDED, STEPS_ENDED, RunStatus, block_outcomes, left_out, step_outcomes
from manipcli.judge.verdict import INTERRUPTED, ExpectationOutcome, StepOutcome, Verdict, VerdictWord, broken_at
from manipcli.model.robot import RobotModel
from manipcli.record.recording import Recording
from manipcli.scene.scene import Scene
from manipcli.spec.condition import ExpectationSpec

STORED, UNTIL = "verdict", "until"
"""Metadata of the log: the verdict at the end of the run, and the time [s] of its last judged tick."""
RUN = "run"
"""Metadata of the log: task, seed, engine, physics (`full` | `none`), period."""


def judge(
    recording: Recording,
    *,
    expect: Sequence[ExpectationSpec],
    robot: RobotModel,
    scene: Scene,
    implied: Sequence[ExpectationSpec] = (),
    sensors: Mapping[str, Sensed] = NO_SENSORS,
    traces: MarginTraces | None = None,
) -> Verdict:
    """Judge a recording against the expectations of its task.

    In this order: a run that was interrupted or did not finish, or whose log is incomplete, is an `error`; a step that
    is not done makes it `failed`, unless the task tolerates that (`on_fail: continue`) or its branch was not taken; so
    does a block that times out. An expectation that fails or is not evaluated makes it `failed`; one that is asked only
    of skipped steps does not. Of a part of a task, steps outside of it and expectations that concern them do not count
    (see `judge/outside.py`). Without expectations only the steps count, and the text says so.

    Args:
        recording: the log.
        expect: the expectations, in the order of the task in the log.
        robot, scene: built from the attachments of the log.
        implied: expectations that the task does not write; they fail the run, but are not part of its expectations.
            One that cannot be evaluated is dropped.
        sensors: of the task, whose readings the recording has.
        traces: get the margins over time, in the order of `expect`.
    """
    run = recording.metadata.get(RUN, {})
    status = recording.end.get("status", "")
    errors = _errors(recording, status)
    part = RunPart.from_metadata(recording.metadata[PART]) if PART in recording.metadata else None
    steps = not_asked(step_outcomes(recording, interrupted=bool(errors)), part)
    examined = examine(
        recording,
        (*(of_part(each, steps) for each in expect), *implied),
        robot=robot,
        scene=scene,
        seam=CONDITIONS,
        physics=run.get("physics", "") == "full",
        sensors=sensors,
        steps=tuple(step for step in steps if not step.excused or step.started is None),  # without those of clients
        until=next((event.time for event in recording.events if event.kind == STEPS_ENDED), inf),
        traces=traces,
    )
    outcomes = tuple(_unless_broken(expectation, recording) for expectation in examined.outcomes[: len(expect)])
    unwritten = tuple(each for each in examined.outcomes[len(expect) :] if each.outcome != "not_evaluated")
    if part is not None and part.partial:
        outcomes = tuple(
            unless_outside(outcome, spec, part, steps, CONDITIONS)
            for outcome, spec in zip(outcomes, expect, strict=True)
        )
    errors = errors or _cut_short(recording, examined.end)
    cause = recording.end.get("cause", "") if status == RunStatus.FAILED else _broken_after_all(recording)
    found = Verdict(
        task=run.get("task", ""),
        verdict="error",
        seed=int(run["seed"]) if run.get("seed", "").isdecimal() else 0,
        engine=run.get("engine", ""),
        simulated_time=examined.end,
        steps=steps,
        expectations=outcomes,
        implied=unwritten,
        errors=errors,
        drawn=_drawn(recording),
        saturations=Saturations.from_metadata(recording.metadata, end=examined.end, period=recording.period),
        self_contacts=examined.self_contacts,
        located=examined.located,
        holding=tuple(dict.fromkeys(event.text for event in recording.events if event.kind == "attached")),
        part=part,
        blocks=block_outcomes(recording, interrupted=bool(errors)),
    )
    word, text = _verdict(found, cause)
    return replace(found, verdict=word, text=text if part is None else f"{text}; {part}")


def _broken_after_all(recording: Recording) -> str:
    """The watch that stopped the robot after its last step; within a step, the step reports it."""
    broken = [event.text for event in recording.events if event.kind == "watch_broken" and not event.step]
    return f"stopped after the last step: {broken[0]}" if broken else ""


def _unless_broken(outcome: ExpectationOutcome, recording: Recording) -> ExpectationOutcome:
    """The outcome; not evaluated if a watch broke between two ticks of a thinned log, whose ticks do not show it."""
    beginning = broken_at(outcome.name)
    broken = [
        event.text for event in recording.events if event.kind == "watch_broken" and event.text.startswith(beginning)
    ]
    if not broken or outcome.outcome != "passed":
        return outcome
    text = f"broken at {broken[0].removeprefix(beginning)}; the log does not contain this tick"
    return ExpectationOutcome(outcome.name, "not_evaluated", None, outcome.unit, None, text)


def _drawn(recording: Recording) -> Drawn | None:
    """The sample of the run; None also if its metadata is damaged."""
    try:
        return Drawn.from_metadata(recording.metadata[SAMPLE]) if SAMPLE in recording.metadata else None
    except ValueError:
        return None


def _errors(recording: Recording, status: str) -> tuple[Diagnostic, ...]:
    """Why the recording is not that of a finished run."""
    errors = []
    if status == RunStatus.INTERRUPTED:
        errors.append(Diagnostic(INTERRUPTED, "the run was interrupted"))
    elif status not in ENDED:
        what = f"status '{status}'" if status else "no status"
        errors.append(Diagnostic("RUN103", f"the run did not finish: the log has {what}"))
    if recording.lost is not None:
        errors.append(Diagnostic("RUN104", f"the log is incomplete: {recording.lost}"))
    elif status == RunStatus.COMPLETE and left_out(recording):
        errors.append(Diagnostic("RUN104", f"the log is incomplete: {left_out(recording)}"))
    return tuple(errors)


def _cut_short(recording: Recording, end: float) -> tuple[Diagnostic, ...]:
    """An error if the last messages are missing: the stored verdict covers a later tick."""
    try:
        until = float(recording.metadata.get(STORED, {}).get(UNTIL, ""))
    except ValueError:
        return ()
    if until - end > ROUNDING:
        return (Diagnostic("RUN104", f"the log is incomplete: it ends at {end:.3f} s, the run at {until:.3f} s"),)
    return ()


def _verdict(found: Verdict, cause: str) -> tuple[VerdictWord, str]:
    """The verdict, and its reason in one line. `cause`: what ended the simulation early; "" if nothing did."""
    steps, expectations = tuple(step for step in found.steps if not step.excused), found.expectations
    if found.errors:
        return "error", found.errors[0].message
    if cause and not any(step.went_wrong for step in steps):
        return "failed", cause
    undone = next((step for step in steps if step.outcome not in ("done", "skipped") and not step.tolerated), None)
    at_fault = found.blocks_at_fault
    if at_fault and (undone is None or undone.outcome == "not_run"):
        block = at_fault[0]
        why = f": {block.text}" if block.text else ""
        return "failed", f"{block.label} {'timed out' if block.outcome == 'timeout' else block.outcome}{why}"
    if undone is not None:
        why = f": {undone.text}" if undone.text else ""
        first = undone.attempts[0].text if undone.attempts else ""
        if first not in ("", undone.text):
            why += f" (first attempt: {first})"
        return "failed", f"step '{undone.id}' {undone.outcome.replace('_', ' ').replace('timeout', 'timed out')}{why}"
    held = found.part is not None and found.part.live and found.part.partial
    if not steps and not held:
        return "failed", "the recording has no steps"
    asked = [expectation for expectation in (*expectations, *found.implied) if not expectation.excused]
    unmet = next((expectation for expectation in asked if expectation.missed), None)
    if unmet is not None:
        why = f": {unmet.text}" if unmet.text else ""
        return "failed", f"expectation '{unmet.name}' {unmet.outcome.replace('_', ' ')}{why}"
    if held:
        return "passed", _met(expectations) if expectations else "nothing to judge: the task has no expectations"
    return "passed", f"{_done(steps)}{', ' if expectations else '; '}{_met(expectations)}"


def _done(steps: Sequence[StepOutcome]) -> str:
    failed = [step.id for step in steps if step.tolerated and step.outcome != "not_run"]
    others = [(word, sum(step.outcome == word for step in steps)) for word in ("skipped", "not_run")]
    others = [(word, count) for word, count in others if count]
    if not failed and not others:
        return f"all {len(steps)} steps done" if len(steps) > 1 else "1 step done"
    done = f"{sum(step.outcome == 'done' for step in steps)} of {len(steps)} steps done"
    done += "".join(f", {count} {word.replace('_', ' ')}" for word, count in others)
    return f"{done}, failure of {listed(failed)} tolerated" if failed else done


def _met(expectations: Sequence[ExpectationOutcome]) -> str:
    if not expectations:
        return "the task has no expectations"
    asked = [one for one in expectations if one.outcome != "skipped" and not one.excused]
    if not asked:
        return "no expectation evaluated"
    if len(asked) == len(expectations):
        return f"all {len(asked)} expectations met" if len(asked) > 1 else "1 expectation met"
    skipped = sum(one.outcome == "skipped" for one in expectations)
    others = f"{skipped} skipped" if skipped else ""
    if len(asked) + skipped < len(expectations):
        others = ", ".join(filter(None, (others, "the others not evaluated")))
    return f"{len(asked)} of {len(expectations)} expectations met, {others}"
