"""`step_done`: a step is done."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import ROUNDING, StateWindow
from manipcli.core.prose import named
from manipcli.core.text import did_you_mean, listed
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import StepName


class StepDoneSpec(Model):
    """The step is done."""

    step: StepName = Field(description="Id of a step of the task.")


def monitor(spec: StepDoneSpec, world: World) -> Monitor:
    """1 from the time at which the step is done, -1 before and if it fails; without unit."""

    def look(window: StateWindow) -> Robustness:
        step = next(step for step in window.steps if step.id == spec.step)
        done = step.outcome == "done" and step.ended is not None
        since = step.ended if done and step.ended is not None else np.inf
        margins = np.where(window.times >= since - ROUNDING, 1.0, -1.0)

        def ahead(k: int) -> bool:
            """Whether the step ends after tick `k`."""
            return step.ended is not None and step.ended - ROUNDING > window.times[k]

        def describe(k: int) -> str:
            ran = step.outcome or ("not run" if step.started is None else "not ended")
            if ahead(k):
                ran = f"not done before {step.ended:.2f} s" if done else "not ended yet"
            return f"step '{step.id}': {ran.replace('_', ' ')}"

        def at(k: int) -> float | None:
            return float(window.times[k]) if ahead(k) else step.ended

        return robustness(margins, window.times, unit="", scale=1.0, describe=describe, at=at)

    return look


def check(spec: StepDoneSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown step."""
    if context.steps is None or spec.step in context.steps:
        return ()
    if spec.step in context.blocks:
        inside = [step for step in context.steps if step.startswith((f"{spec.step}/", f"{spec.step}["))]
        return (Problem(("step",), f"'{spec.step}' is a block, not a step", f"name a step in it: {listed(inside)}"),)
    return (Problem(("step",), f"the task has no step '{spec.step}'", did_you_mean(spec.step, context.steps)),)


def clause(spec: StepDoneSpec, robot: RobotModel) -> str:
    return f"step {named(spec.step)} is done"


STEP_DONE = Condition(
    name="step_done",
    spec=StepDoneSpec,
    units=("",),
    open=monitor,
    check=check,
    absent=lambda spec, world: None if spec.step in world.steps else f"the recording has no step '{spec.step}'",
    clause=clause,
    example="step_done: {step: lift_1}",
    stateless=True,
)
