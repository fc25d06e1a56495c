"""Joint paths that keep the constraints of a step: the straight one, the tool's straight line, or a searched one.

The search is that of `path_planners.rrt_connect`, in which every new configuration is projected onto the constraints:
Newton steps on the least margin m(q), dq = (target - m) grad m / |grad m|^2, with the gradient by differences. Edges
are examined at small steps, with a part of the constraint in reserve for the smooth curve through the waypoints.
Source: Berenson, Srinivasa, Ferguson and Kuffner, "Manipulation planning on constraint manifolds" (ICRA 2009).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import CollisionQuery
from manipcli.model.configuration import position_limits
from manipcli.plan.free_space import FreeSpace
from manipcli.plan.keep import ROUNDING, Kept, margins, refuse_unkept
from manipcli.plan.motion import PlanningState
from manipcli.plan.path import linear_path
from manipcli.plan.path_planner import PathFailure, PathProblem
from manipcli.plan.path_planners.rrt_connect import RrtConnect, RrtConnectSpec
from manipcli.plan.path_shortening import shortened
from manipcli.plan.planner import Planner

_STEP: Final = 0.02  # rad or m of the joint that moves most, between examined configurations
_SPACING: Final = 0.1  # rad or m, between the waypoints of the smooth curve
_RESERVE: Final = 0.004  # rad or m of margin along edges: for the curve between waypoints
_DIFFERENCE: Final = 1e-6
_NEWTON: Final = 20
_LONGEST: Final = 0.3  # rad or m: step of the trees; longer edges leave the constraint
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

    # The ends may use the reserve.
    reserve = min(_RESERVE, 0.5 * float(margin(np.stack((start[columns], end[columns]))).min()))
    reserve = max(reserve, 0.0)

    def project(q: Array) -> Array | None:
        return projected(margin, q, reserve)

    def edge(a: Array, b: Array) -> bool:
        return bool(margin(_between(a, b, _STEP)).min() >= reserve - ROUNDING) and space.edge(a, b)

    def valid(q: Array) -> bool:
        return bool(margin(q[None])[0] >= reserve - ROUNDING) and space.valid(q)

    lower, upper = position_limits(robot.joint(name) for name in names)
    ends = np.stack((start[columns], end[columns]))
    problem = PathProblem(
        start=ends[0],
        goals=ends[1:],
        lower=np.where(np.isfinite(lower), np.minimum(lower, ends.min(axis=0)), ends.min(axis=0) - np.pi),
        upper=np.where(np.isfinite(upper), np.maximum(upper, ends.max(axis=0)), ends.max(axis=0) + np.pi),
        valid=valid,
        edge=edge,
        project=project,
    )
    rng = planner.rng.spawn(1)[0]
    found = RrtConnect(RrtConnectSpec(samples=_SAMPLES, range=_LONGEST)).plan(problem, rng)
    if isinstance(found, PathFailure):
        words = ", ".join(f"`{kept.name}`" for kept in keeps)
        hint = "make the constraint wider, or `move` to a pose in between"
        raise NotPlannable(f"no path keeps {words}: {found.why}", hint=hint, reason="constraint")
    short = shortened(found, problem, rng, attempts=_SHORTCUTS)
    return np.vstack([short[:1], *(_between(a, b, _SPACING)[1:] for a, b in pairwise(short))])


def projected(margin: Callable[[Array], Array], q: Array, least: float) -> Array | None:
    """The configuration near `q` (m) whose margin is at least `least`; None if Newton's method finds none."""
    q = np.array(q)
    for _ in range(_NEWTON):
        around = np.vstack((q, q + _DIFFERENCE * np.eye(len(q))))
        values = margin(around)
        if values[0] >= least:
            return q
        slope = (values[1:] - values[0]) / _DIFFERENCE
        square = float(slope @ slope)
        if square < 1e-12:
            return None
        q = q + (1.05 * (least - values[0]) + ROUNDING) / square * slope
    return None


def _least(keeps: tuple[Kept, ...], start: Array, columns: list[int], path: Array) -> float:
    """The least margin along a polyline (k, m)."""
    points = np.vstack([_between(a, b, _STEP) for a, b in pairwise(path)])
    whole = np.tile(start, (len(points), 1))
    whole[:, columns] = points
    return float(margins(keeps, whole).min())


def _between(a: Array, b: Array, step: float) -> Array:
    """(k, m) from a to b, both included, in steps of at most `step` of the joint that moves most."""
    count = max(1, int(np.ceil(float(np.max(np.abs(b - a))) / step)))
    return np.asarray(a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a))
