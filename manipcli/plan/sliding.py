"""A body that slides over what it stands on: the force that this needs, and edges that it would catch on."""

from __future__ import annotations

from typing import Final

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.scene import drop_test

LEVEL: Final = 3e-4
"""[m] By which an edge may stand out: contacts penetrate by as much."""


def resistance(planner: Planner, state: PlanningState, name: str, axis: Array) -> float:
    """[N] along `axis` (3,), a level unit vector, that slides a body with its contents: m (mu g_down - g . axis).

    Both bodies' coefficients of friction multiply. On several supports it is that of the smoothest; 0 on none.
    """
    body = planner.scene.body(name)
    middle = (_bottom(planner, state, name) + _top(planner, state, name)) / 2.0
    touched = {each for pair in planner.touching(state, name) if name in pair for each in pair} - {name}
    under = [each for each in planner.scene.bodies if each.name in touched]
    supports = [each for each in under if _top(planner, state, each.name) < middle]
    if not supports:
        return 0.0
    mass = body.mass + sum(planner.scene.body(each).mass for each in planner.contents(state, name))
    mu, gravity = body.friction * min(each.friction for each in supports), planner.scene.gravity
    return mass * (mu * max(0.0, -float(gravity[2])) - float(gravity @ axis))


def refuse_too_heavy(planner: Planner, state: PlanningState, name: str, axis: Array, force: float) -> None:
    """
    Raises:
        NotPlannable: `force` [N] does not overcome the friction under a body.
    """
    needs = resistance(planner, state, name, axis)
    if force <= needs:
        message = f"'{name}' does not move with {readable(force, 'N')}: friction holds it with {readable(needs, 'N')}"
        raise NotPlannable(message, hint=f"`force` above {readable(needs, 'N')}, or less friction or mass")


def step_up(planner: Planner, state: PlanningState, name: str, other: str) -> float:
    """[m] By which the top of another body is higher than what a body stands on."""
    return _top(planner, state, other) - _bottom(planner, state, name)


def refuse_step_up(planner: Planner, state: PlanningState, name: str, onto: str) -> None:
    """
    Raises:
        NotPlannable: the top of the body `onto` is higher than what a body stands on: it would catch on its edge.
    """
    edge = step_up(planner, state, name, onto)
    if edge > LEVEL:
        message = f"'{name}' would catch on the edge of '{onto}', {readable(edge, 'm')} above what it stands on"
        hint = f"lower '{onto}' until its top is level, or set the goal by `to: [x, y]` without a body there"
        raise NotPlannable(message, hint=hint, parts=frozenset((onto,)))


def _top(planner: Planner, state: PlanningState, name: str) -> float:
    """[m] Highest point in the world."""
    return drop_test.top(planner.scene.body(name), planner.body_pose(state, name))


def _bottom(planner: Planner, state: PlanningState, name: str) -> float:
    """[m] Lowest point in the world."""
    return drop_test.bottom(planner.scene.body(name), planner.body_pose(state, name))
