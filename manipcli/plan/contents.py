"""What a container holds in a planned state."""

from __future__ import annotations

from collections.abc import Set
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.plan.motion import PlanningState
from manipcli.scene.scene import Interior
from manipcli.shapes.primitives import Cylinder

if TYPE_CHECKING:
    from manipcli.plan.planner import Planner


def contents_of(planner: Planner, state: PlanningState, container: str) -> tuple[str, ...]:
    """The movable bodies whose centre lies in the interior of this one, and what is heaped on it or on them."""
    interior = planner.scene.body(container).interior
    if interior is None:
        return ()
    X_SW = (planner.body_pose(state, container) @ interior.X_OS).inverse()
    places = {
        body.name: X_SW @ X_WO @ Transform.of(xyz=body.centre)
        for body, X_WO in zip(planner.scene.movable, state.bodies, strict=True)
        if body.name != container
    }
    found = {name for name, X_SP in places.items() if interior.contains(X_SP.p)}
    above = {name for name, X in places.items() if name not in found and _heaped(planner, interior, name, X)}
    while on := {name for name in above if _touches(planner, state, name, {container, *found})}:
        found |= on
        above -= on
    return tuple(name for name in places if name in found)


def _heaped(planner: Planner, interior: Interior, name: str, X_SP: Transform) -> bool:
    """Whether a body is above the interior, by no more than its own size."""
    depth = interior.shape.length if isinstance(interior.shape, Cylinder) else interior.shape.size[2]
    high = float(X_SP.p[2]) - depth / 2.0
    flat = Transform.of(xyz=(X_SP.p[0], X_SP.p[1], 0.0))
    return 0.0 <= high <= float(np.max(planner.scene.body(name).size)) and interior.contains(flat.p)


def _touches(planner: Planner, state: PlanningState, name: str, others: Set[str]) -> bool:
    """Whether a movable body touches one of the others."""
    return any(name in pair and not others.isdisjoint(pair) for pair in planner.touching(state, name))
