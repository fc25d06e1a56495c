"""Goals of a placed object: its pose on a supporting body, and places in a region."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import Carried, CollisionHit
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.scene import drop_test
from manipcli.scene.drop_test import FORMED, drop_height
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Cylinder

UPRIGHT: Final = float(np.cos(np.radians(5.0)))
"""Cosine of the tilt: a body that is more upright than this can be placed on."""
ROOM: Final = 0.01
"""[m] Distance in a region that a placed object keeps from all bodies but its support."""
LEVEL: Final = 1e-6
"""[m] A body may reach this far above the bottom of the object and still count as below it."""
SPOTS: Final = 128
"""Number of places in a region that are examined."""


def standing(
    planner: Planner,
    state: PlanningState,
    name: str,
    onto: str,
    at: tuple[float, float],
    yaw: float | None,
    word: str = "at",
    key: str = "onto",
    frame: str = "world",
) -> Transform:
    """X_WG of an object that stands upright on a body at [x, y] in the world, with this yaw [rad] or its present one.

    `word` and `key` are the keys of the step that set the place and the support, `frame` what the place refers to.

    Raises:
        NotPlannable: the support is tilted, or is not below this place.
    """
    body, under = planner.scene.body(name), planner.scene.body(onto)
    X_WU = planner.body_pose(state, onto)
    if X_WU.R[2, 2] < UPRIGHT:
        raise NotPlannable(f"'{onto}' is tilted; '{name}' cannot be placed on it", loc=(key,))
    floor, size = floor_of(under)
    x, y, _ = X_WU.inverse().apply([*at, 0.0]) - under.centre
    if abs(x) > size[0] / 2 or abs(y) > size[1] / 2:
        refers = "the world frame" if frame == "world" else f"the frame of '{frame}', these points in the world"
        raise NotPlannable(
            f"[{at[0]:g}, {at[1]:g}] m is outside '{onto}', whose centre is at [{X_WU.p[0]:g}, {X_WU.p[1]:g}] m",
            hint=f"`{word}` is in {refers}; '{onto}' offers {size[0]:g} m x {size[1]:g} m about its centre",
            loc=(word,),
        )
    bottom = float(body.centre[2] - body.size[2] / 2)
    turned = heading(planner.body_pose(state, name).R) if yaw is None else yaw
    X_WG = Transform.of(xyz=(*at, X_WU.p[2] + floor - bottom), rpy=(0.0, 0.0, turned))
    if under.kind not in FORMED:
        return X_WG
    deeper = drop_height(body, X_WG, under, X_WU)
    if deeper is None:
        raise NotPlannable(
            f"no part of '{onto}' is below '{name}' at [{at[0]:g}, {at[1]:g}] m",
            hint=f"choose `{word}` over a part of '{onto}'",
            loc=(word,),
        )
    return Transform.of(xyz=(0.0, 0.0, -deeper)) @ X_WG


def heading(R: Array) -> float:
    """[rad] Angle of the x axis of a rotation (3, 3) about the vertical."""
    return float(np.arctan2(R[1, 0], R[0, 0]))


def spots(centre: tuple[float, float], size: tuple[float, float]) -> Iterator[tuple[float, float]]:
    """Places in a rectangle, the nearest to its centre first; spread evenly (Halton, Numerische Mathematik 2, 1960)."""
    shares = [(0.0, 0.0), *((_halton(k, 2) - 0.5, _halton(k, 3) - 0.5) for k in range(1, SPOTS))]
    places = [(centre[0] + size[0] * x, centre[1] + size[1] * y) for x, y in shares]
    yield from dict.fromkeys(sorted(places, key=lambda at: math.dist(at, centre)))


def _halton(k: int, base: int) -> float:
    """The k-th number in [0, 1) whose digits in `base` are those of k mirrored at the point."""
    value, share = 0.0, 1.0
    while k:
        share /= base
        k, digit = divmod(k, base)
        value += share * digit
    return value


def crowded(
    planner: Planner, state: PlanningState, name: str, X_WG: Transform, onto: str | None
) -> CollisionHit | None:
    """The nearest body within `ROOM` of an object at `X_WG`, other than its support; None without any.

    What lies wholly below the object does not crowd it: the desk under a tray with a thin floor.
    """
    bottom = drop_test.bottom(planner.scene.body(name), X_WG) + LEVEL

    def beside(hit: CollisionHit) -> bool:
        other = hit.a if hit.b == name else hit.b
        return drop_test.top(planner.scene.body(other), planner.body_pose(state, other)) > bottom

    found = hits_at(planner, state, name, X_WG, margin=ROOM)
    near = [hit for hit in found if not {hit.a, hit.b} & {onto} and beside(hit)]
    return min(near, key=lambda hit: hit.distance, default=None)


def hits_at(
    planner: Planner, state: PlanningState, name: str, X_WG: Transform, *, margin: float
) -> tuple[CollisionHit, ...]:
    """Every body within `margin` [m] of an object at `X_WG`, without what the object contains."""
    carried = Carried(body=name, link=planner.robot.root, X_LO=planner.robot.X_WB.inverse() @ X_WG)
    absent = planner.contents(state, name)
    there = planner.checker.at(state.bodies, carried=carried, margin=margin, only=name, absent=absent)
    return tuple(hit for hit in there.every(state.position) if _is_body(hit))


def _is_body(hit: CollisionHit) -> bool:
    """Whether both parts are bodies: the hand is at the object."""
    return not hit.a.startswith("robot/") and not hit.b.startswith("robot/")


def floor_of(under: Body) -> tuple[float, tuple[float, float]]:
    """Height [m] of the supporting surface of a body above its O, and its size (x, y) [m]."""
    if under.interior is None:
        return float(under.centre[2] + under.size[2] / 2), (float(under.size[0]), float(under.size[1]))
    shape, middle = under.interior.shape, float(under.interior.X_OS.p[2])
    if isinstance(shape, Cylinder):
        return middle - shape.length / 2, (2 * shape.radius, 2 * shape.radius)
    return middle - shape.size[2] / 2, shape.size[:2]
