"""Joint paths that keep the constraints of a step without a search: the straight one, or the tool's straight line."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.keep import Kept, margins, refuse_unkept
from manipcli.plan.kept_problem import ROUNDING, STEP, between
from manipcli.plan.motion import PlanningState
from manipcli.plan.path import linear_path
from manipcli.plan.planner import Planner

_SAME: Final = 1e-3  # rad or m


def kept_paths(
    planner: Planner,
    state: PlanningState,
    names: tuple[str, ...],
    end: Array,
    keeps: tuple[Kept, ...],
    line: Transform | None = None,
) -> Iterator[Array]:
    """Paths to try: waypoints (k, m) of the joints `names` from the state to `end` (n); none where a search is needed.

    The straight path, two waypoints, is the only one where it keeps `keeps`.

    Args:
        planner, state: what moves.
        names: the joints that move.
        end: of all joints.
        keeps: those on configurations count.
        line: the tool pose at `end`, if the arm may arrive there in another configuration; None where it may not.

    Raises:
        NotPlannable: start or end violate a constraint.
    """
    columns = planner.robot.indices(names)
    start = np.array(state.position)
    straight = np.stack((start[columns], end[columns]))
    shape = tuple(kept for kept in keeps if kept.margin is not None)
    if not shape or _least(shape, start, columns, straight) >= -ROUNDING:
        yield straight
        return
    refuse_unkept(shape, np.zeros(1), start[None])
    for kept in shape:
        if margins((kept,), end[None])[0] < -ROUNDING:
            raise NotPlannable(f"{kept.text(end)} at its end", hint="move it elsewhere", reason="constraint")
    on_line = _tool_line(planner, state, names, end, line)
    if on_line is not None and _least(shape, start, columns, on_line) >= -ROUNDING:
        yield on_line


def _tool_line(
    planner: Planner, state: PlanningState, names: tuple[str, ...], end: Array, line: Transform | None
) -> Array | None:
    """The tool's straight line, if the arm can follow it and arrives at `end` or may arrive elsewhere."""
    solver = planner.solver
    if set(names) != set(solver.joints):
        return None
    try:
        path = linear_path(solver, state.position, solver.forward(end) if line is None else line)
    except NotPlannable:
        return None
    target = end[list(solver.columns)]
    if line is None and np.max(np.abs(path[-1] - target)) > _SAME:
        return None
    order = [solver.joints.index(name) for name in names]
    ordered = np.array(path)[:, order]
    if line is None:
        ordered[-1] = target[order]
    return ordered


def unkept_straight(
    planner: Planner, state: PlanningState, names: tuple[str, ...], end: Array, keeps: tuple[Kept, ...]
) -> NotPlannable:
    """Refusal of the straight path to `end` (n): the constraint that it violates most, and by how much."""
    columns = planner.robot.indices(names)
    points = between(np.array(state.position[columns]), end[columns], STEP)
    whole = np.tile(state.position, (len(points), 1))
    whole[:, columns] = points
    shape = [kept for kept in keeps if kept.margin is not None]
    worst = min(shape, key=lambda kept: float(margins((kept,), whole).min()))
    q = whole[int(np.argmin(margins((worst,), whole)))]
    hint = "make the constraint wider, or `move` to a pose in between"
    return NotPlannable(f"{worst.text(q)} on the straight path", hint=hint, reason="constraint")


def _least(keeps: tuple[Kept, ...], start: Array, columns: list[int], path: Array) -> float:
    """The least margin along a polyline (k, m)."""
    points = np.vstack([between(a, b, STEP) for a, b in pairwise(path)])
    whole = np.tile(start, (len(points), 1))
    whole[:, columns] = points
    return float(margins(keeps, whole).min())
