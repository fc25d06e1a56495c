"""A step from outside of a task's files: a task that has it as its only step, with the robot and scene of another."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput, Loc, Place
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.motion import PlanningState
from manipcli.plan.outline import StepOutline
from manipcli.plan.planner import Planner
from manipcli.simulate.sensor_layout import sensed_by_name
from manipcli.spec.load import load_step_text
from manipcli.spec.located import Located
from manipcli.spec.source.tree import child, node_at
from manipcli.task.consistency import not_there
from manipcli.task.felt import felt
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task
from manipcli.task.vocabulary import task_spec

NAME: Final = "step"
"""The name of the text in places: `step:1:8`."""
EXAMPLE: Final = "write a step as in a task file: `{pick: {object: cup}}`"


def lone_step(text: str, task: Task, number: int, claims: Claims) -> Task:
    """A task with one step.

    Args:
        text: a step as in a task file, in YAML or JSON: `{pick: {object: cup}}`. It has no parameters.
        task: whose robot, scene, settings and watches it uses.
        number: of the step; its id becomes `pick@3`, or with an id in the text, `cup@3`, which no task has.
        claims: of the controllers now.

    Raises:
        InvalidInput: every finding about the step, with its place in the text.
    """
    if not text.strip():
        raise InvalidInput([Diagnostic("TASK333", "the text is empty", Place(NAME, 1, 1), EXAMPLE)])
    try:
        file = load_step_text(text, NAME, model=task_spec())
        steps = file.spec.steps
        if len(steps) != 1 or file.spec.blocks:
            message = "this is a block of steps; expected one step with a verb"
            raise InvalidInput([Diagnostic("TASK333", message, Place(NAME, 1, 1), "send its steps one after another")])
        (step,) = steps
        node = node_at(file.source.root, ("steps", 0))
        name = step.verb if child(node, "id") is None else step.id
        changed = {"steps": steps, "blocks": (), "replan": task.spec.replan or True}
        alone = Located(task.spec.model_copy(update={**changed, "expect": (), "watch": ()}), file.source)
        sensors = {**felt(task.spec), **sensed_by_name(task.sensors, task.robot, task.scene)}
        errors = [
            each for each in not_there(alone, task.robot, task.scene, sensors, claims) if each.severity == "error"
        ]
        if errors:
            raise InvalidInput(errors)
    except InvalidInput as invalid:
        raise InvalidInput([_without_index(finding) for finding in invalid.findings]) from None
    named = step.model_copy(update={"id": f"{name}@{number}"})
    spec = task.spec.model_copy(update={**changed, "steps": (named,)})
    places: dict[Loc, str] = {key: task.log_place(*key) for key in task.spec.judged_at}
    return replace(task, file=Located(spec, file.source), places=places)


def lone_plan(task: Task, start: PlanningState, planner: Planner) -> Plan:
    """The plan of such a task before it is planned, from which its step is started."""
    step = task.spec.steps[0]
    return Plan((), start, planner, listed=(StepOutline(str(step.id), step.verb, task.log_place("steps", 0), None),))


def _without_index(finding: Diagnostic) -> Diagnostic:
    """The finding as one about the step, not about a task with a list of steps and parameters."""
    message = finding.message.removeprefix("steps[0]").removeprefix(".").removeprefix(": ")
    hint = "write its value: a step of a client has no parameters" if "unknown parameter" in message else finding.hint
    return replace(finding, message=message, hint=hint)
