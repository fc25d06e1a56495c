"""`place`: set a held object down, let go, and withdraw."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from typing import TypeVar

import numpy as np

from manipcli.conditions.condition import Problem
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.core.prose import amount, between, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.carrying import carry
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.free_motion import line_blocked
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.place_goals import ROOM, UPRIGHT, crowded, spots
from manipcli.plan.planner import CLEARANCE, Planner
from manipcli.plan.prediction import put
from manipcli.plan.ranges import spread
from manipcli.plan.step import StepMember
from manipcli.plan.steps.pick import backed_off, slopes
from manipcli.plan.steps.place_spec import PlaceSpec, RegionSpec, check, where
from manipcli.plan.steps.placed import goal, in_region, located
from manipcli.scene.scene import Body

T = TypeVar("T")

TILTS = tuple(np.radians([0.0, 2.0, 4.0]))
"""Candidate tilts [rad] of the object when it is released."""
ROUND = ("cup", "cylinder", "sphere")
"""Bodies that are as wide along their diagonal as along their axes."""
PLACES = 16
"""Number of places in a region, with room for the object, to which motions are planned."""
WAYS = 9
"""Number of ways to set the object down that are tried at each place in a region."""
POINTING = 0.5
"""Cosine to the ground: a tool below this points up or down."""
_OVER = (
    "carry it over the obstacle: `lift: {by: ...}` higher, and lower it from higher, `clearance: ...`; "
    "or first `move` to a pose from which the path is free"
)
_LOWER = (
    "if the hand collides, grasp the object higher, `grasp: {height: ...}` of its `pick`; "
    "else place it elsewhere, `at: [x, y]`, or rotate it, `yaw: ...`"
)
_WITHIN = "place it within reach, `at: [x, y]`; or use another grasp: `approach: {yaw: ...}` of its `pick`"
_LOWER_FROM = "lower it from less high, `clearance: ...`: the arm reaches the place, but not {}"
_RETREAT = "withdraw the hand less, `retreat: ...`"
_ROOMIER = "place it where the opening fingers have room, rotate it: `yaw: ...`, or open the hand less: `posture: ...`"


def candidates(spec: PlaceSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Places in the region, and at each the tilts of the object, clearances, and withdrawals of the hand."""
    planner.held(state, spec.object)
    planner.free_start(state)
    what = f"cannot place '{spec.object}'"
    if spec.region is None:
        X_WG = goal(spec, planner, state)
        held_back: list[NotPlannable] = []
        explain = partial(_explained, spec, planner, state, X_WG, held_back)
        return Candidates(_at(spec, planner, state, X_WG, held_back), what=what, decides="place", explain=explain)
    region, in_world = spec.region.box, located(spec.region, planner, state)
    _refuse_off_support(spec, planner, state, spec.region)

    examined: set[tuple[float, float]] = set()  # a place that the search skips does not count

    def examine(at: tuple[float, float], done: Callable[[], T]) -> T:
        examined.add(at)
        return done()

    def places() -> Iterator[Candidate]:
        for spot in spots(region.centre, region.size):
            at = in_world(spot)
            where = f"at [{at[0]:.3f}, {at[1]:.3f}] m"
            try:
                X_WG = _free(spec, planner, state, at)
            except NotPlannable as refusal:
                yield Candidate(partial(_refused, refusal), name=where)
                continue
            if len(examined) == PLACES:
                return
            share = np.subtract(spot, region.centre) / np.maximum(region.size, 1e-9)
            for X_WO in _yaws(spec, planner, state, X_WG):
                for way in itertools.islice(_ways(spec, planner, state, X_WO, []), WAYS):
                    plan, look = partial(examine, at, way.plan), partial(examine, at, way.look)
                    yield replace(way, name=f"{where}, {way.name}", place=share, plan=plan, look=look)

    return Candidates(places(), what=what, decides="place")


def _refuse_off_support(spec: PlaceSpec, planner: Planner, state: PlanningState, region: RegionSpec) -> None:
    """Check that a place in the region is on the support, which depends on no other step.

    Raises:
        NotPlannable: none is.
    """
    refusal: NotPlannable | None = None
    in_world = located(region, planner, state)
    for spot in spots(region.box.centre, region.box.size):
        try:
            in_region(spec, planner, state, in_world(spot))
        except NotPlannable as other:
            refusal = refusal or other
        else:
            return
    if refusal is not None:
        raise refusal.but(cause=f"no place in the region is on '{spec.support}': {refusal.cause}")


def _free(spec: PlaceSpec, planner: Planner, state: PlanningState, at: tuple[float, float]) -> Transform:
    """X_WG at a place in the region.

    Raises:
        NotPlannable: it is not on the support, or too near to another body.
    """
    X_WG = in_region(spec, planner, state, at)
    hit = crowded(planner, state, spec.object, X_WG, spec.support)
    if hit is None:
        return X_WG
    other = hit.a if hit.b == spec.object else hit.b
    cause = f"a place in the region is within {1000 * ROOM:.0f} mm of '{other}'"
    raise NotPlannable(cause, hint=f"make `region` larger, or move '{other}'", parts=frozenset((other,)))


def _refused(refusal: NotPlannable) -> StepPlan:
    raise refusal


def _at(
    spec: PlaceSpec, planner: Planner, state: PlanningState, X_WG: Transform, held_back: list[NotPlannable]
) -> Iterator[Candidate]:
    """The ways to set the object down at `X_WG`, then those at the yaw that an arm of few joints has there."""
    for X_WO in _yaws(spec, planner, state, X_WG):
        turned = "" if X_WO is X_WG else f"at a yaw of {math.degrees(X_WO.rpy[2]):.0f} deg, "
        for way in _ways(spec, planner, state, X_WO, held_back):
            yield replace(way, name=turned + way.name)


def _explained(
    spec: PlaceSpec,
    planner: Planner,
    state: PlanningState,
    X_WG: Transform,
    held_back: list[NotPlannable],
    refusal: NotPlannable,
) -> NotPlannable:
    """The refusal, with hints if the arm reaches the place but not a point above it, or cannot withdraw from it."""
    X_OT = planner.held_in_tool(state).inverse()

    def reached(height: float) -> bool:
        goals = [Transform.of(xyz=(0.0, 0.0, height)) @ X_WO @ X_OT for X_WO in _yaws(spec, planner, state, X_WG)]
        return any(planner.solver.reachable(goal, state.position) for goal in goals)

    hints = [_RETREAT] if held_back else []
    high = next((height for height in spread(spec.clearance) if not reached(height)), None)
    if high is not None and reached(0.0):
        hints.insert(0, _LOWER_FROM.format(f"{readable(high, 'm')} above it"))
    return refusal.but(hint="; or ".join(dict.fromkeys([*hints, *filter(None, [refusal.hint])])) or None)


def _yaws(spec: PlaceSpec, planner: Planner, state: PlanningState, X_WG: Transform) -> Iterator[Transform]:
    """`X_WG`, and the same pose at the yaw that an arm of few joints has there, if no yaw is stated."""
    yield X_WG
    if not planner.solver.few or spec.yaw is not None or spec.at_start:
        return
    carried, tool = state.carried, planner.robot.tool
    assert carried is not None and tool is not None  # `held` asks for it
    solver = planner.solver.of(tool.X_LT @ planner.held_in_tool(state)).leaving("yaw")
    try:
        q = solver.solve(X_WG, state.position, planner.rng)
    except NotPlannable:
        return
    yield Transform.of(xyz=X_WG.p, R=solver.forward(q).R)


def _ways(
    spec: PlaceSpec, planner: Planner, state: PlanningState, X_WG: Transform, held_back: list[NotPlannable]
) -> Iterator[Candidate]:
    """The ways to set the object down at `X_WG`.

    The object is placed upright; at [x, y] it keeps its yaw, or gets `yaw`. Withdrawals that the arm cannot follow are
    appended to `held_back`.

    Paths on which the hand withdraws clear of the object are tried first, then those on which it may graze it; only the
    latter if the open hand is too near to it anyway, as around an object that sits deep in the hand. If the arm comes
    too near to something, the object is set down a little tilted, with the arm higher: it rights itself when released.
    """
    X_OT = planner.held_in_tool(state).inverse()
    lowered: dict[tuple[float, float], MotionBuilder | NotPlannable] = {}

    def above(X_WL: Transform, clearance: float) -> Transform:
        return Transform.of(xyz=(0.0, 0.0, clearance)) @ (X_WL @ X_OT)

    def tilted(tilt: float) -> Transform:
        return _tilted(planner.scene.body(spec.object), X_WG, X_OT, tilt)

    @cache
    def look(tilt: float, clearance: float) -> NotPlannable | None:
        """Why it surely cannot be carried there while no paths are searched."""
        if planner.searching(obstructed=False) is not None:
            return None
        refusal = line_blocked(planner, state, above(tilted(tilt), clearance), planner.query(state))
        if refusal is not None:
            planner.searching()
        return refusal

    def lower(tilt: float, clearance: float) -> MotionBuilder:
        """Carry and lower to the place; planned once for all withdrawals."""
        X_WL = tilted(tilt)
        X_WT = X_WL @ X_OT
        builder = MotionBuilder(planner, state)
        with _hinted(_OVER):
            carry(planner, builder, "carry", above(X_WL, clearance), speed=spec.velocity_scaling)
        support = planner.touching(put(planner, builder.now, {spec.object: X_WL}), spec.object)
        with _hinted(_LOWER):
            builder.straight("lower", X_WT, speed=spec.velocity_scaling / 2, allowed=support)
        return builder

    def attempt(tilt: float, grazing: bool, clearance: float, retreat: float, slope: float) -> StepPlan:
        if (tilt, clearance) not in lowered:
            try:
                lowered[tilt, clearance] = lower(tilt, clearance)
            except NotPlannable as refusal:
                lowered[tilt, clearance] = refusal
        down = lowered[tilt, clearance]
        if isinstance(down, NotPlannable):
            raise down
        builder = down.copy()
        with _hinted(_ROOMIER):
            builder.open(spec.posture, must_arrive=True)
        X_WT = planner.tool_pose(builder.now)
        back = backed_off(X_WT, retreat, slope)
        try:
            builder.withdraw(back, spec.object, speed=spec.velocity_scaling, grazing=grazing)
        except NotPlannable as refusal:
            if refusal.reason != "line":
                raise
            held_back.append(refusal)
            raise refusal.but(hint=_RETREAT) from refusal
        planned = builder.plan()
        return replace(planned, end=put(planner, planned.end, {spec.object: X_WG}), placed=spec.object)

    near = planner.distance(MotionBuilder(planner, state).let_go(spec.posture), spec.object) < CLEARANCE
    withdrawals = spread(spec.clearance), spread(spec.retreat), [slopes()[k] for k in (1, 2, 0)]
    upright = any(keep.upright is not None or keep.slosh is not None for keep in planner.keep)
    tilts = TILTS if not upright and X_WG.R[2, 2] > UPRIGHT and _horizontal(X_WG @ X_OT) is not None else TILTS[:1]
    ways = itertools.product(tilts, (True,) if near else (False, True), *withdrawals)
    for way in ways:
        tilt, _, clearance, *_ = way
        yield Candidate(partial(attempt, *way), name=_name(*way), look=partial(look, tilt, clearance))


def _name(tilt: float, grazing: bool, clearance: float, retreat: float, slope: float) -> str:
    tilted = f"tilted {readable(tilt, 'rad')}, " if tilt else ""
    way = f"{readable(retreat, 'm')}{f' at a slope of {math.degrees(slope):.0f} deg' if slope else ''}"
    return f"{tilted}from {readable(clearance, 'm')} above, withdrawing {way}{', grazing it' if grazing else ''}"


@contextmanager
def _hinted(hint: str) -> Iterator[None]:
    """Gives refusals inside this hint for a collision, and a hint on reach for an unreachable line."""
    try:
        yield
    except NotPlannable as refusal:
        better = {"in_the_way": hint, "line": _WITHIN}.get(refusal.reason or "", refusal.hint)
        raise refusal.but(hint=better) from refusal


def _horizontal(X_WT: Transform) -> Array | None:
    """(3,) the horizontal direction in which the tool points; None if it points up or down."""
    x, y, _ = X_WT.R[:, 2]
    length = float(np.hypot(x, y))
    return np.array([x, y, 0.0]) / length if length > POINTING else None


def _tilted(body: Body, X_WG: Transform, X_OT: Transform, tilt: float) -> Transform:
    """X_WO of a body at X_WG, tilted on its far edge by `tilt` [rad], so that the arm behind the tool is higher."""
    h = _horizontal(X_WG @ X_OT)
    if h is None or tilt == 0.0:
        return X_WG
    foot = X_WG @ Transform.of(xyz=(body.centre[0], body.centre[1], body.centre[2] - body.size[2] / 2))
    x, y, _ = np.abs(X_WG.R.T @ h)
    width, depth, _ = body.size
    edge = max(width, depth) / 2 if body.kind in ROUND else (x * width + y * depth) / 2
    # A rotation about z x h tilts h downwards; the far edge stays on the ground.
    R = matrix_from_axis_angle(np.cross([0.0, 0.0, 1.0], h), tilt)
    up = np.array([0.0, 0.0, edge * np.sin(tilt)])
    about = Transform.of(xyz=foot.p + up, R=R) @ Transform.of(xyz=-foot.p)
    return about @ X_WG


def uncommanded(spec: PlaceSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool or a hand without a controller."""
    return unmoved_tool(claims, robot, ("object",)) + unmoved_hand(claims, robot, spec.posture, ("posture",))


def clause(spec: PlaceSpec, robot: RobotModel) -> str:
    yaw = "" if spec.yaw is None else f" with a yaw of {amount(spec.yaw, 'rad')}"
    return (
        f"place {named(spec.object)} {where(spec)}{yaw}: lower it straight from {between(spec.clearance, 'm')} above, "
        f"open the hand (pose {named(spec.posture)}), and withdraw it by {between(spec.retreat, 'm')}"
        f"{at_share(spec.velocity_scaling, 0.5)}"
    )


MEMBER = StepMember(
    name="place", spec=PlaceSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause
)
