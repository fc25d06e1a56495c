"""Joint paths that keep the constraints of a step: the straight one, the tool's straight line, or a searched one.

The search is that of `path_planners.rrt_connect`, in which every new configuration is projected onto the constraints,
see `kept_problem`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import CollisionQuery
from manipcli.model.configuration import position_limits
from manipcli.plan.free_space import FreeSpace
from manipcli.plan.keep import Kept, margins, refuse_unkept
from manipcli.plan.kept_problem import LONGEST, ROUNDING, STEP, between, kept_problem
from manipcli.plan.motion import PlanningState
from manipcli.plan.path import linear_path
from manipcli.plan.path_planner import PathFailure, PathProblem
from manipcli.plan.path_planners.rrt_connect import RrtConnect, RrtConnectSpec
from manipcli.plan.path_shortening import shortened
from manipcli.plan.planner import Planner

_SPACING: Final = 0.1  # rad or m, between the waypoints of the smooth curve
_SAMPLES: Final = 4000
_SHORTCUTS: Final = 100
_SAME: Final = 1e-3  # rad or m


def kept_paths(
    planner: Planner,
    state: PlanningState,
    query: CollisionQuery,
    names: tuple[str, ...],
    end: Array,
    keeps: tuple[Kept, ...],
    line: Transform | None = None,
) -> Iterator[Array]:
    """Paths to try: waypoints (k, m) of the joints `names` from the state to `end` (n).

    The straight path, two waypoints, is the only one where it keeps `keeps`.

    Args:
        planner, state, query: what moves, and what is free.
        names: the joints that move.
        end: of all joints.
        keeps: those on configurations count.
        line: the tool pose at `end`, if the arm may arrive there in another configuration; None where it may not.

    Raises:
        NotPlannable: start or end violate a constraint, or no path was found that keeps it.
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
    yield _searched(planner, state, query, names, end, shape)


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


def _searched(
    planner: Planner,
    state: PlanningState,
    query: CollisionQuery,
    names: tuple[str, ...],
    end: Array,
    keeps: tuple[Kept, ...],
) -> Array:
    robot = planner.robot
    columns = robot.indices(names)
    start = np.array(state.position)
    space = FreeSpace(robot, query, names, [start])

    def margin(q: Array) -> Array:
        whole = np.tile(start, (len(q), 1))
        whole[:, columns] = q
        return margins(keeps, whole)

    lower, upper = position_limits(robot.joint(name) for name in names)
    ends = np.stack((start[columns], end[columns]))
    problem = PathProblem(
        start=ends[0],
        goals=ends[1:],
        lower=np.where(np.isfinite(lower), np.minimum(lower, ends.min(axis=0)), ends.min(axis=0) - np.pi),
        upper=np.where(np.isfinite(upper), np.maximum(upper, ends.max(axis=0)), ends.max(axis=0) + np.pi),
        valid=space.valid,
        edge=space.edge,
    )
    problem = kept_problem(problem, margin)
    rng = planner.rng.spawn(1)[0]
    found = RrtConnect(RrtConnectSpec(samples=_SAMPLES, range=LONGEST)).plan(problem, rng)
    if isinstance(found, PathFailure):
        words = ", ".join(f"`{kept.name}`" for kept in keeps)
        hint = "make the constraint wider, or `move` to a pose in between"
        raise NotPlannable(f"no path keeps {words}: {found.why}", hint=hint, reason="constraint")
    short = shortened(found, problem, rng, attempts=_SHORTCUTS)
    return np.vstack([short[:1], *(between(a, b, _SPACING)[1:] for a, b in pairwise(short))])


def _least(keeps: tuple[Kept, ...], start: Array, columns: list[int], path: Array) -> float:
    """The least margin along a polyline (k, m)."""
    points = np.vstack([between(a, b, STEP) for a, b in pairwise(path)])
    whole = np.tile(start, (len(points), 1))
    whole[:, columns] = points
    return float(margins(keeps, whole).min())
