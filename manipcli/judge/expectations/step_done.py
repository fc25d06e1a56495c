"""`step_done`: a step was done."""

from __future__ import annotations

from pydantic import Field

from manipcli.core.text import did_you_mean
from manipcli.judge.expectation import Evidence, Expectation, Measured, NotEvaluated
from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.record.recording import Span
from manipcli.spec.base import Model


class StepDoneSpec(Model):
    """The step was done."""

    step: str = Field(description="Id of a step of the task.")


def evaluate(spec: StepDoneSpec, evidence: Evidence, span: Span) -> Measured | NotEvaluated:
    """1 when the step is done, -1 otherwise; there is no half a step."""
    for step in evidence.steps:
        if step.id == spec.step:
            text = f"step '{step.id}': {step.outcome}"
            return Measured(margin=1.0 if step.outcome == "done" else -1.0, unit="", at=step.ended, text=text)
    return NotEvaluated(f"the recording knows no step '{spec.step}'")


def check(spec: StepDoneSpec, robot: RobotModel, scene: Scene, steps: tuple[str, ...]) -> tuple[Problem, ...]:
    """The task has the step."""
    if spec.step in steps:
        return ()
    return (Problem(("step",), f"the task has no step '{spec.step}'", did_you_mean(spec.step, steps)),)


STEP_DONE = Expectation(name="step_done", spec=StepDoneSpec, scope="end", evaluate=evaluate, check=check)
