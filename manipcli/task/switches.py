"""Switches of controllers, foreseen by the rules by which the manager carries them out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from manipcli.conditions.condition import Problem
from manipcli.control.lifecycle import ControllerState, decided
from manipcli.model.robot import RobotModel
from manipcli.plan.claims import Claim, Claims
from manipcli.plan.motion import Switch
from manipcli.plan.steps import STEPS
from manipcli.spec.task import StepSpec


def foreseen(switch: Switch, claims: Claims, robot: RobotModel) -> tuple[tuple[Problem, ...], Claims]:
    """Why a switch would be refused, and who is active after it; after one that is refused, whoever was.

    Args:
        switch: what a step asks for.
        claims: the controllers, before it.
        robot: the robot.
    """
    controllers: dict[str, tuple[Claim, ControllerState]] = {
        one.name: (one, "active" if one.active else "inactive") for one in claims.controllers
    }
    decision = decided(controllers, switch, robot.joint_names, robot.following)
    if decision.ok:
        return (), claims.switched(decision.activated, decision.deactivated)
    hint = "say `to` for those that shall be active: it deactivates who is in their way" if not switch.to else None
    return tuple(Problem((), message, hint) for message in decision.messages), claims


def active_in(steps: Sequence[StepSpec], claims: Claims, robot: RobotModel) -> Iterator[frozenset[str]]:
    """Names of the controllers that are active before the first step, and in each step."""
    yield _active(claims)
    for step in steps:
        switch = STEPS[step.verb].request(step.body)
        if switch is not None:
            _, claims = foreseen(switch, claims, robot)
        yield _active(claims)


def _active(claims: Claims) -> frozenset[str]:
    return frozenset(one.name for one in claims.controllers if one.active)
