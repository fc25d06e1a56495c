"""Prediction of controller switches, by the same rules as the controller manager."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from manipcli.conditions.condition import Problem
from manipcli.control.lifecycle import ControllerState, decided
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claim, Claims
from manipcli.plan.motion import Switch
from manipcli.plan.steps import STEPS
from manipcli.spec.step import StepSpec


def foreseen(switch: Switch, claims: Claims, robot: RobotModel) -> tuple[tuple[Problem, ...], Claims]:
    """Problems of a switch, and the claims after it; a refused switch leaves the claims unchanged.

    Args:
        switch: the switch that a step requests.
        claims: the controllers before it.
        robot: the robot.
    """
    controllers: dict[str, tuple[Claim, ControllerState]] = {
        claim.name: (claim, "active" if claim.active else "inactive") for claim in claims.controllers
    }
    decision = decided(controllers, switch, robot.joint_names, robot.following)
    if decision.ok:
        return (), claims.switched(decision.activated, decision.deactivated)
    hint = "name the controllers to activate under `to`: it deactivates conflicting ones" if not switch.to else None
    return tuple(Problem((), message, hint) for message in decision.messages), claims


def active_in(steps: Sequence[StepSpec], claims: Claims, robot: RobotModel) -> Iterator[frozenset[str]]:
    """Names of the active controllers before the first step, then during each step."""
    yield _active(claims)
    for step in steps:
        switch = STEPS[step.verb].request(step.body)
        if switch is not None:
            _, claims = foreseen(switch, claims, robot)
        yield _active(claims)


def _active(claims: Claims) -> frozenset[str]:
    return frozenset(claim.name for claim in claims.controllers if claim.active)
