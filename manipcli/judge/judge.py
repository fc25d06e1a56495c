"""The verdict on a run, from its recording alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from manipcli.core.errors import Finding
from manipcli.core.registry import Seam
from manipcli.judge.expectation import Evidence, Expectation, NotEvaluated, outcome
from manipcli.judge.expectations import EXPECTATIONS
from manipcli.judge.steps import step_outcomes
from manipcli.judge.verdict import INTERRUPTED, ExpectationOutcome, StepOutcome, Verdict, VerdictWord
from manipcli.model.condition import World
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.record.recording import Recording
from manipcli.spec.base import Model

RUN = "run"
"""Metadata of the log: task, seed, engine, physics (`full` | `none`), period, status."""

_JUDGED = ("complete", "failed")
"""Values of `status` of a run that came to its own end, whether it went well or not."""


def judge(
    recording: Recording,
    *,
    expect: Sequence[tuple[str, Model]],
    robot: RobotModel,
    scene: Scene,
    seam: Seam[Expectation[Any]] = EXPECTATIONS,
) -> Verdict:
    """Judge a recording by what its task expected.

    The order of importance: a run that was interrupted, crashed or has lost its end is an `error`, whatever else is
    true of it; a step that is not done makes it `failed`; so does an expectation that is not met, or could not be
    evaluated. With no expectations the steps alone decide, and the text says so.

    Args:
        recording: the log.
        expect: word and validated block of each expectation, in the order of the task in the log.
        robot, scene: built from the log's own attachments.
        seam: the expectations that the words name.
    """
    run = recording.metadata.get(RUN, {})
    status = run.get("status", "")
    errors = _errors(recording, status)
    steps = step_outcomes(recording, interrupted=bool(errors) and status != "crashed")
    expectations = _expectations(recording, expect, robot, scene, seam, run.get("physics", ""), steps)
    word, text = _verdict(errors, steps, expectations)
    times = recording.states.time
    return Verdict(
        task=run.get("task", ""),
        verdict=word,
        seed=int(run["seed"]) if run.get("seed", "").isdecimal() else 0,
        engine=run.get("engine", ""),
        simulated_time=float(times[-1]) if times.size else 0.0,
        steps=steps,
        expectations=expectations,
        errors=errors,
        text=text,
    )


def _errors(recording: Recording, status: str) -> tuple[Finding, ...]:
    """Why the recording is not that of a run which came to its end."""
    errors = []
    if status == "interrupted":
        errors.append(Finding(INTERRUPTED, "the run was interrupted"))
    elif status == "crashed":
        errors.append(Finding("RUN102", "the run crashed", hint="its log ends where it did; see its last events"))
    elif status not in _JUDGED:
        what = f"status '{status}'" if status else "no status"
        errors.append(Finding("RUN103", f"the run did not come to its end: the log has {what}"))
    if recording.lost is not None:
        errors.append(Finding("RUN104", f"the log is incomplete: {recording.lost}"))
    return tuple(errors)


def _expectations(
    recording: Recording,
    expect: Sequence[tuple[str, Model]],
    robot: RobotModel,
    scene: Scene,
    seam: Seam[Expectation[Any]],
    physics: str,
    steps: tuple[StepOutcome, ...],
) -> tuple[ExpectationOutcome, ...]:
    """One outcome each; the second and later of one word get a number (`near`, `near_2`)."""
    states = _ordered(recording, robot, scene)
    evidence: Evidence | None = None
    if isinstance(states, WorldState):
        recording = replace(recording, states=states)
        start = _first(states)
        evidence = Evidence(recording, World(robot, scene, start), physics == "full", steps)
    outcomes, seen = [], Counter[str]()
    for name, spec in expect:
        seen[name] += 1
        label = name if seen[name] == 1 else f"{name}_{seen[name]}"
        found = NotEvaluated(str(states)) if evidence is None else seam[name].evaluate(spec, evidence)
        outcomes.append(outcome(label, found))
    return tuple(outcomes)


def _ordered(recording: Recording, robot: RobotModel, scene: Scene) -> WorldState | str:
    """The recorded states with joints and bodies in the order of robot and scene, or what is missing in them."""
    bodies = tuple(body.name for body in scene.movable)
    for kind, wanted, there in (
        ("joint", robot.joint_names, recording.joint_names),
        ("body", bodies, recording.body_names),
    ):
        missing = [name for name in wanted if name not in there]
        if missing:
            return f"the recording does not hold {kind} '{missing[0]}'"
    states = recording.states
    if states.time.size == 0:
        return "the recording holds no state"
    if recording.joint_names == robot.joint_names and recording.body_names == bodies:
        return states
    joint = [recording.joint_names.index(name) for name in robot.joint_names]
    body = [recording.body_names.index(name) for name in bodies]
    return WorldState(
        time=states.time,
        position=states.position[:, joint],
        velocity=states.velocity[:, joint],
        effort=states.effort[:, joint],
        body_position=states.body_position[:, body],
        body_quat_xyzw=states.body_quat_xyzw[:, body],
        body_linear=states.body_linear[:, body],
        body_angular=states.body_angular[:, body],
    )


def _first(states: WorldState) -> WorldState:
    """The state at time 0, without leading axes."""
    return WorldState(
        time=states.time[0],
        position=states.position[0],
        velocity=states.velocity[0],
        effort=states.effort[0],
        body_position=states.body_position[0],
        body_quat_xyzw=states.body_quat_xyzw[0],
        body_linear=states.body_linear[0],
        body_angular=states.body_angular[0],
    )


def _verdict(
    errors: tuple[Finding, ...], steps: tuple[StepOutcome, ...], expectations: tuple[ExpectationOutcome, ...]
) -> tuple[VerdictWord, str]:
    """The word, and in one line why."""
    if errors:
        return "error", errors[0].message
    undone = next((step for step in steps if step.outcome != "done"), None)
    if undone is not None:
        why = f": {undone.text}" if undone.text else ""
        return "failed", f"step '{undone.id}' {undone.outcome.replace('_', ' ')}{why}"
    if not steps:
        return "failed", "the recording knows no steps"
    unmet = next((one for one in expectations if one.outcome != "passed"), None)
    if unmet is not None:
        why = f": {unmet.text}" if unmet.text else ""
        return "failed", f"expectation '{unmet.name}' {unmet.outcome.replace('_', ' ')}{why}"
    done = f"all {len(steps)} steps done" if len(steps) > 1 else "its one step done"
    if not expectations:
        return "passed", f"{done}; the task states no expectations"
    met = f"all {len(expectations)} expectations met" if len(expectations) > 1 else "its one expectation met"
    return "passed", f"{done}, {met}"
