"""Where bodies will be: what is held goes with the hand, what lies in that goes with it, or falls into a container;
what is pushed slides; and where a hand that feels its way will stop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Pairs, Planner
from manipcli.plan.trajectory import JointTrajectory
from manipcli.shapes.primitives import Cylinder

PRESSED: Final = 1e-3
"""[m] Deeper in it than at the start by this the hand pushes a body: what it only leaves stays where it is."""
_LOOKS: Final = 60  # at the way of a hand that touches: each takes a fraction of a millisecond


def put(planner: Planner, state: PlanningState, where: Mapping[str, Transform]) -> PlanningState:
    """The state with some movable bodies elsewhere, at X_WO by name."""
    bodies = zip(planner.scene.movable, state.bodies, strict=True)
    return replace(state, bodies=tuple(where.get(body.name, X_WO) for body, X_WO in bodies))


def carried_along(planner: Planner, before: PlanningState, now: PlanningState) -> PlanningState:
    """What was held `before` has gone with the hand to where the joints are `now`, and what lay in it, too."""
    carried = before.carried
    if carried is None:
        return now
    X_WO = planner.kinematics.forward(now.position, carried.link) @ carried.X_LO
    X_WA = planner.body_pose(before, carried.body)
    moved = {carried.body: X_WO}
    for name in planner.contents(before, carried.body):
        moved[name] = X_WO @ X_WA.inverse() @ planner.body_pose(before, name)
    return put(planner, now, moved)


def spilled(planner: Planner, state: PlanningState, into: str) -> PlanningState:
    """What lay in the carried body lies on the floor of the container `into`."""
    carried, interior = state.carried, planner.scene.body(into).interior
    if carried is None or interior is None:
        return state
    shape = interior.shape
    depth = shape.length if isinstance(shape, Cylinder) else shape.size[2]
    X_WS = planner.body_pose(state, into) @ interior.X_OS
    landed = {}
    for name in planner.contents(state, carried.body):
        body = planner.scene.body(name)
        bottom = body.centre[2] - body.size[2] / 2
        landed[name] = X_WS @ Transform.of(xyz=(-body.centre[0], -body.centre[1], -depth / 2 - bottom))
    return put(planner, state, landed)


def met(
    planner: Planner, before: PlanningState, now: PlanningState, motion: JointTrajectory, touching: Pairs
) -> PlanningState:
    """`now`, or where on the way there one of the pairs that may touch is about to, or to press deeper than before."""
    query, pairs = planner.query(before), set(map(frozenset, touching))

    def depth(q: Array) -> float:
        return min((hit.distance for hit in query.every(q) if {hit.a, hit.b} in pairs), default=np.inf)

    way = _looks(planner, now, motion)
    deep = min(0.0, depth(way[0])) - PRESSED
    free = next((k for k, q in enumerate(way) if depth(q) < deep), len(way)) - 1
    return carried_along(planner, before, now.moved(frozen(way[free])))


def _looks(planner: Planner, state: PlanningState, motion: JointTrajectory) -> Array:
    """(_LOOKS, n) joint positions on the way, the first and the last among them; other joints are as in `state`."""
    way = np.tile(state.position, (_LOOKS, 1))
    columns = planner.robot.indices(motion.names)
    way[:, columns] = motion.positions[np.linspace(0, len(motion.positions) - 1, _LOOKS).astype(int)]
    return way


def pushed(
    planner: Planner, before: PlanningState, now: PlanningState, motion: JointTrajectory, bodies: Iterable[str]
) -> PlanningState:
    """Each of the `bodies` that can move has slid along the ground as far as the tool went since the hand met it, and
    what lies in it, too."""
    way = _looks(planner, before, motion)
    end = planner.tool_pose(now).p
    held = () if before.carried is None else (before.carried.body,)
    slid: dict[str, Transform] = {}
    taken: dict[str, Transform] = {}
    for name in bodies:
        if planner.scene.body(name).fixed:
            continue
        deep = min(0.0, planner.distance(before, name)) - PRESSED
        met = next((q for q in way if planner.distance(before.moved(q), name) < deep), None)
        if met is not None:
            x, y, _ = end - planner.tool_pose(before.moved(met)).p
            shift = Transform.of(xyz=(x, y, 0.0))
            slid[name] = shift @ planner.body_pose(before, name)
            inside = [one for one in planner.contents(before, name) if one not in held]
            taken |= {one: shift @ planner.body_pose(before, one) for one in inside}
    return put(planner, now, taken | slid)
