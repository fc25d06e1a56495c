"""Prediction of body poses after a motion: carried with the hand, spilled into a container, or pushed.

Also where a guarded motion stops.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.model.configuration import with_joints
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Pairs, Planner
from manipcli.plan.trajectory import JointTrajectory

PRESSED: Final = 1e-3
"""[m] A body is pushed where the hand is deeper in it than at the start by this; one that the hand leaves stays."""
_SAMPLES: Final = 60  # samples of the path of a touching hand; each takes a fraction of a millisecond


def put(planner: Planner, state: PlanningState, where: Mapping[str, Transform]) -> PlanningState:
    """The state with some movable bodies moved to X_WO, by name."""
    bodies = zip(planner.scene.movable, state.bodies, strict=True)
    return replace(state, bodies=tuple(where.get(body.name, X_WO) for body, X_WO in bodies))


def carried_along(planner: Planner, before: PlanningState, now: PlanningState) -> PlanningState:
    """The state `now` with the body held `before`, and its contents, moved along with the hand."""
    carried = before.carried
    if carried is None:
        return now
    X_WO = planner.kinematics.forward(now.position, carried.link) @ carried.X_LO
    X_WA = planner.body_pose(before, carried.body)
    moved = {carried.body: X_WO}
    for name in planner.aboard(before, carried.body):
        moved[name] = X_WO @ X_WA.inverse() @ planner.body_pose(before, name)
    return put(planner, now, moved)


def spilled(planner: Planner, state: PlanningState, into: str, most: int | None = None) -> PlanningState:
    """The state with the contents of the carried body, or `most` of them, on the floor of the container `into`."""
    carried, interior = state.carried, planner.scene.body(into).interior
    if carried is None or interior is None:
        return state
    X_WS = planner.body_pose(state, into) @ interior.X_OS
    landed = {}
    for name in planner.contents(state, carried.body)[:most]:
        body = planner.scene.body(name)
        bottom = body.centre[2] - body.size[2] / 2
        landed[name] = X_WS @ Transform.of(xyz=(-body.centre[0], -body.centre[1], interior.floor - bottom))
    return put(planner, state, landed)


def met(
    planner: Planner, before: PlanningState, now: PlanningState, motion: JointTrajectory, touching: Pairs
) -> PlanningState:
    """`now`, or the state on the path there just before a pair that may touch does, or presses deeper than before."""
    query, pairs = planner.query(before), set(map(frozenset, touching))

    def depth(q: Array) -> float:
        return min((hit.distance for hit in query.every(q) if {hit.a, hit.b} in pairs), default=np.inf)

    path = _samples(planner, now, motion)
    deep = min(0.0, depth(path[0])) - PRESSED
    free = next((k for k, q in enumerate(path) if depth(q) < deep), len(path)) - 1
    return carried_along(planner, before, now.moved(frozen(path[free])))


def _samples(planner: Planner, state: PlanningState, motion: JointTrajectory) -> Array:
    """(_SAMPLES, n) joint positions on the path, with its first and its last; other joints are as in `state`."""
    some = motion.positions[np.linspace(0, len(motion.positions) - 1, _SAMPLES).astype(int)]
    return with_joints(planner.robot, state.position, motion.names, some)


def pushed(
    planner: Planner, before: PlanningState, now: PlanningState, motion: JointTrajectory, bodies: Iterable[str]
) -> PlanningState:
    """The state with each movable body of `bodies`, and its contents, moved horizontally with the tool at contact."""
    path = _samples(planner, before, motion)
    end = planner.tool_pose(now).p
    held = () if before.carried is None else (before.carried.body,)
    slid: dict[str, Transform] = {}
    taken: dict[str, Transform] = {}
    for name in bodies:
        if planner.scene.body(name).fixed:
            continue
        deep = min(0.0, planner.distance(before, name)) - PRESSED
        met = next((q for q in path if planner.distance(before.moved(q), name) < deep), None)
        if met is not None:
            x, y, _ = end - planner.tool_pose(before.moved(met)).p
            shift = Transform.of(xyz=(x, y, 0.0))
            slid[name] = shift @ planner.body_pose(before, name)
            inside = [body for body in planner.contents(before, name) if body not in held]
            taken |= {body: shift @ planner.body_pose(before, body) for body in inside}
    return put(planner, now, taken | slid)
