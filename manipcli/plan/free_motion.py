"""Motions around obstacles: a searched path, its corners rounded, timed without stops, and checked once more."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import RESOLUTION, CollisionQuery
from manipcli.model.edge_check import SLACK
from manipcli.plan.constrained_motion import smooth_motion, straight_motion
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.keep import margins, reserving
from manipcli.plan.kept_path import unkept_straight
from manipcli.plan.motion import Grip, Motion, PlanningState
from manipcli.plan.motion_constraints import applying, keeps_of
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import linear_path
from manipcli.plan.path_search import PathSearch
from manipcli.plan.path_smoothing import rounded
from manipcli.plan.planner import InTheWay, Planner
from manipcli.plan.sweep import blocked, first_hit, swept
from manipcli.plan.trajectory import JointTrajectory

BRANCHES: Final = 8
"""Most configurations of the arm at a goal pose among which a search may choose."""
BRANCH: Final = 0.3
"""[rad or m] Configurations of the arm that differ by less in every joint count as the same candidate."""
_TRIES: Final = 24  # random starts of the inverse kinematics
_OTHER: Final = 0.05  # rad or m: least difference of two branches
_FINER: Final = 1.0, 0.25, 0.06, 0.015  # shares of the deviation, tried in this order
_KEPT: Final = 0.75  # of the clearance
_SURE: Final = 1.0 - SLACK - 0.05  # of the clearance: 0.2 mm of 4 mm for the curve between control ticks
_ROUNDS: Final = 3  # paths: the hand may be elsewhere than where the search assumed it


Goals = Callable[[np.random.Generator], Array]
"""Draws the goals (k, m) of a search."""


def free_trajectory(
    planner: Planner,
    state: PlanningState,
    query: CollisionQuery,
    straight: JointTrajectory | None,
    grip: Grip | None,
    limits: MotionLimits,
    label: str,
    verb: str,
    goals: Goals | None,
    target: Array,
) -> JointTrajectory:
    """The `straight` motion where it is free; else around obstacles, if `goals` are given and paths are searched.

    Without one that keeps the constraints, a path that does is searched, to the `target` (n) if no `goals` are given.

    Raises:
        NotPlannable: both are obstructed, or violate a constraint.
    """
    if straight is None:
        with labelled(label, verb):
            return _keeping(planner, state, query, grip, limits, label, goals, target)
    hit = first_hit(planner, state, query, straight, grip)
    if hit is None:
        return straight
    refusal = blocked(planner, state, hit, label, move=verb == "move")
    end = swept(planner, state, straight, grip)[1][-1]
    search = planner.searching() if goals is not None and hit.time > 0.0 and not query.touches(end) else None
    if search is None or goals is None:
        raise refusal
    with labelled(label, verb):
        return around(planner, search, state, query, goals(search.rng), limits, grip, label)


def _keeping(
    planner: Planner,
    state: PlanningState,
    query: CollisionQuery,
    grip: Grip | None,
    limits: MotionLimits,
    label: str,
    goals: Goals | None,
    target: Array,
) -> JointTrajectory:
    """A searched motion that keeps the constraints; without any, a straight one that leaves no reserve to the run."""
    search = planner.searching()
    refusal: NotPlannable | None = None
    if search is not None:
        ends = target[list(planner.robot.indices(limits.names))][None] if goals is None else goals(search.rng)
        try:
            return around(planner, search, state, query, ends, limits, grip, label)
        except NotPlannable as other:
            refusal = other
    keeps = applying(keeps_of(planner, state, label), target)
    if refusal is not None or not planner.searches:  # else one is searched later
        unreserved = straight_motion(planner, state, label, limits, target, query=query, line=None, reserve=False)
        if unreserved is not None:
            hit = first_hit(planner, state, query, unreserved, grip)
            if hit is None:
                return unreserved
            refusal = refusal or blocked(planner, state, hit, label)
    raise refusal or unkept_straight(planner, state, limits.names, target, keeps)


def line_blocked(planner: Planner, state: PlanningState, X_WT: Transform, query: CollisionQuery) -> NotPlannable | None:
    """Why the tool surely has no free motion on its straight line to `X_WT`; None if it may have one.

    It is found without timing the line. A motion that `first_hit` accepts is anywhere further than 1 - `SLACK` of the
    clearance from what it must not touch, and passes through every point of the path.
    """
    nearer = query.nearer(_SURE)
    solver = planner.solver

    def visit(q: Array) -> None:
        hit = nearer.check(q)
        if hit is not None:
            text, parts = planner.in_the_way(hit)
            raise NotPlannable(text, reason="in_the_way", parts=parts)

    refused: NotPlannable | None = None
    for each in (solver, solver.leaving("yaw")) if solver.few else (solver,):
        try:
            linear_path(each, state.position, X_WT, visit)
        except NotPlannable as refusal:
            refused = refused or refusal
        else:
            return None
    return refused


def refusing(
    planner: Planner, query: CollisionQuery, start: Array, *, free: bool, avoid: Sequence[Array] = ()
) -> Callable[[Array], object | None]:
    """Why a solution (n) of the inverse kinematics is rejected: a collision, with `free` also on its straight path.

    Where paths are searched, that path need not be free. Solutions near one of `avoid` are rejected, too.
    """

    def refuse(q: Array) -> object | None:
        if any(np.abs(q - other).max() < BRANCH for other in avoid):
            return "it has the configuration of a candidate that was tried before"
        hit = query.check(q)
        if hit is not None or not free:
            return None if hit is None else planner.in_the_way(hit)
        count = max(1, int(np.ceil(float(np.max(np.abs(q - start))) / RESOLUTION)))
        share = np.linspace(0.0, 1.0, count + 1)
        hit = query.check_trajectory(range(len(q)), start, share, start + share[:, None] * (q - start))
        if hit is None or planner.searching() is not None:
            return None
        text, parts = planner.in_the_way(hit)
        return InTheWay(f"{text}, on the path there", parts)

    return refuse


@contextmanager
def labelled(label: str, verb: str, before: Sequence[Motion] = ()) -> Iterator[None]:
    """Prefixes refusals with the label of their motion, unless it is the step itself; adds the motions `before` it."""
    try:
        with tried(*before):
            yield
    except NotPlannable as refusal:
        if label == verb:
            raise
        raise refusal.but(cause=f"{label}: {refusal.cause}") from refusal


@contextmanager
def tried(*motions: Motion) -> Iterator[None]:
    """Adds to refusals the motions that were planned, for pictures."""
    try:
        yield
    except NotPlannable as refusal:
        raise (refusal if refusal.motions else refusal.but(motions=motions)) from refusal.__cause__


def around(
    planner: Planner,
    search: PathSearch,
    state: PlanningState,
    query: CollisionQuery,
    goals: Array,
    limits: MotionLimits,
    grip: Grip | None,
    label: str,
) -> JointTrajectory:
    """The motion of the joints of `limits` on a searched path to one of the `goals` (k, m), at rest at both ends.

    The trajectory itself is checked, together with the hand's own motion: where a rounded corner comes too near, it is
    rounded less, and where the hand's motion does, another path is searched.

    Raises:
        NotPlannable: no path was found, or none that keeps the limits and the clearance when it is timed.
    """
    refusal: NotPlannable | None = None
    # The path keeps the clearance, and half of it between checked configurations. So does the trajectory, whose corners
    # and spline are a little off the path: with three quarters of the clearance at the checked ones.
    nearer = query.nearer(_KEPT)
    slack = (_KEPT + SLACK - 1.0) * query.least_margin
    end = np.array(state.position)
    end[planner.robot.indices(limits.names)] = goals[0]
    keeps = reserving(applying(keeps_of(planner, state, label), end), state.position, end)
    keeps = tuple(kept for kept in keeps if kept.margin is not None)
    margin = partial(margins, keeps) if keeps else None
    words = ", ".join(f"`{kept.name}`" for kept in keeps)
    for _ in range(_ROUNDS):
        path = search.path(planner.robot, state, query, limits.names, goals, grip, margin, words)
        for share in _FINER:
            points = rounded(path, share * search.spec.deviation)
            try:
                trajectory = smooth_motion(planner, state, label, limits, _distinct(points))
            except NotPlannable as cause:
                refusal = cause
                continue
            hit = first_hit(planner, state, nearer, trajectory, grip, slack=slack)
            if hit is None:
                return trajectory
            refusal = NotPlannable(f"no path around obstacles keeps its clearance: {planner.in_the_way(hit)}")
    assert refusal is not None
    raise refusal


def branches(
    solver: InverseKinematics,
    X_WT: Transform,
    first: Array,
    rng: np.random.Generator,
    *,
    query: CollisionQuery,
    limits: MotionLimits,
) -> Array:
    """(k, m) different free positions of the solver's joints with the tool at `X_WT`, at most `BRANCHES`.

    Args:
        solver, X_WT: inverse kinematics, and the goal.
        first: (n) a free solution, the first of the result; the other joints stay as there.
        rng: draws the starts.
        query: of what is free.
        limits: of the solver's joints.
    """
    columns = list(solver.columns)
    found = [np.array(first)]
    lower = np.where(np.isfinite(limits.lower), limits.lower, first[columns] - np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, first[columns] + np.pi)
    for _ in range(_TRIES):
        if len(found) == BRANCHES:
            break
        start = np.array(first)
        start[columns] = rng.uniform(lower, upper)
        attempt = solver.track(X_WT, start)
        if (
            attempt.converged
            and min(float(np.max(np.abs(attempt.q - q))) for q in found) > _OTHER
            and not query.touches(attempt.q)
        ):
            found.append(np.array(attempt.q))
    return np.array(found)[:, columns]


def _distinct(points: Array) -> Array:
    """The points (k, n) without repeated neighbours."""
    keep = [0, *(k + 1 for k, (a, b) in enumerate(pairwise(points)) if float(np.max(np.abs(b - a))) > 1e-6)]
    return points[keep]
