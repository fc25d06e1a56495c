"""Where bodies will be: what is held goes with the hand, what lies in that goes with it, or falls into a container."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from manipcli.core.geometry import Transform
from manipcli.model.robot import Cylinder
from manipcli.plan.planner import Planner
from manipcli.plan.step import Situation


def put(planner: Planner, situation: Situation, where: Mapping[str, Transform]) -> Situation:
    """The situation with some movable bodies elsewhere, at X_WO by name."""
    bodies = zip(planner.scene.movable, situation.bodies, strict=True)
    return replace(situation, bodies=tuple(where.get(body.name, X_WO) for body, X_WO in bodies))


def carried_along(planner: Planner, before: Situation, now: Situation) -> Situation:
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


def spilled(planner: Planner, situation: Situation, into: str) -> Situation:
    """What lay in the carried body lies on the floor of the container `into`."""
    carried, interior = situation.carried, planner.scene.body(into).interior
    if carried is None or interior is None:
        return situation
    shape = interior.shape
    depth = shape.length if isinstance(shape, Cylinder) else shape.size[2]
    X_WS = planner.body_pose(situation, into) @ interior.X_OS
    landed = {}
    for name in planner.contents(situation, carried.body):
        body = planner.scene.body(name)
        bottom = body.centre[2] - body.size[2] / 2
        landed[name] = X_WS @ Transform.of(xyz=(-body.centre[0], -body.centre[1], -depth / 2 - bottom))
    return put(planner, situation, landed)
