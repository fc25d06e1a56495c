"""A task's own interface: steps as in a task file, so that clients work with objects and not with joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.live.command import Answer, Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.live_robot import LiveRobot
from manipcli.live.live_steps import LiveSteps, StepRequest
from manipcli.live.names import CHECK_STEP, RUN_STEP, GoalStatus
from manipcli.task.task import Task

_STATUS: Final = {"done": GoalStatus.SUCCEEDED, "canceled": GoalStatus.CANCELED}


def endpoints(task: Task, controllers: Sequence[Controller]) -> Sequence[Endpoint]:
    """Those under `/task`."""
    return [
        Endpoint("action", RUN_STEP, "manipcli_msgs/action/RunStep", _run),
        Endpoint("service", CHECK_STEP, "manipcli_msgs/srv/CheckStep", _check),
    ]


def _run(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    def began(phase: str) -> None:
        command.answer(Answer(True, {"id": goal.request.id, "phase": phase}))

    goal = StepGoal(command, robot.steps, robot.steps.request(message["step"], began))
    robot.goals.append(goal)
    end = goal.request.end
    if end is not None:
        robot.event("refused", f"{RUN_STEP}: {end.outcome}: {end.text}", outcome="error")


def _check(robot: LiveRobot, command: Command, message: dict[str, Any]) -> Values:
    found = robot.steps.check(message["step"])
    plan, refused = found.planned, found.refused
    return {
        "valid": refused is None or refused.outcome != "invalid",
        "plannable": plan is not None,
        "text": "" if refused is None else refused.text,
        "phases": [] if plan is None else [motion.label for motion in plan.plan.motions],
        "duration": None if plan is None else plan.plan.duration,
    }


@dataclass(frozen=True, slots=True)
class StepGoal:
    """A step that a client asked for; its feedback are the phases as they begin."""

    command: Command
    steps: LiveSteps
    request: StepRequest

    def cancel(self) -> None:
        self.steps.cancel(self.request)

    def step(self, *, due: bool) -> Answer | None:
        end = self.request.end
        if end is None:
            return None
        margin, unit = end.margin or (None, "")
        values: Values = {"id": self.request.id, "outcome": end.outcome, "text": end.text}
        values |= {"margin": margin, "unit": unit}
        return Answer(True, values, status=_STATUS.get(end.outcome, GoalStatus.ABORTED))
