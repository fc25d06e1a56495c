"""Where `place` sets an object down: X_WG of its frame, from the words of the step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from manipcli.conditions.frames import carrier
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.plan.beside import beside
from manipcli.plan.motion import PlanningState
from manipcli.plan.place_goals import UPRIGHT, floor_of, heading, hits_at, standing
from manipcli.plan.planner import Planner
from manipcli.plan.steps.place_spec import PlaceSpec, RegionSpec, RelationSpec
from manipcli.scene import drop_test
from manipcli.scene.drop_test import FORMED, drop_height

DEEPEST: Final = 0.002
"""[m] A deeper overlap at a place is refused; contacts of meshes are not exact."""
MOST_FALL: Final = 0.01
"""[m] A placed object is within this of its place."""
Spot = tuple[float, float]
"""[x, y] [m]."""


def goal(spec: PlaceSpec, planner: Planner, state: PlanningState) -> Transform:
    """X_WG of a place that is not a region.

    Raises:
        NotPlannable: nothing stands there.
    """
    inside = planner.contents(state, spec.object)
    if spec.support in inside:
        raise NotPlannable(f"'{spec.support}' is in '{spec.object}' and moves with it", loc=(spec.support_key,))
    if isinstance(spec.at, RelationSpec) and carrier(planner.scene, spec.at.of) in inside:
        raise NotPlannable(f"'{spec.at.of}' is in '{spec.object}' and moves with it", loc=("at", "of"))
    if spec.at_start:
        return planner.starts.get(spec.object, planner.scene.body(spec.object).X_WO)
    X_WG = _goal(spec, planner, state)
    _refuse_overlap(spec, planner, state, X_WG)
    if spec.support is None:
        _refuse_fall(spec, planner, state, X_WG)
    return X_WG


def _goal(spec: PlaceSpec, planner: Planner, state: PlanningState) -> Transform:
    if isinstance(spec.at, RelationSpec):
        return _related(spec, spec.at, planner, state)
    if isinstance(spec.at, tuple):
        return _on_support(spec, planner, state, spec.at, spec.yaw)
    under = planner.scene.body(spec.support or "")
    X_WU = planner.body_pose(state, under.name)
    x, y, _ = X_WU.apply(under.centre)
    return _on_support(spec, planner, state, (float(x), float(y)), _yaw(spec, X_WU), word=spec.support_key)


def _refuse_overlap(spec: PlaceSpec, planner: Planner, state: PlanningState, X_WG: Transform) -> None:
    """Check that the place is not inside another body.

    Raises:
        NotPlannable: names the deepest overlap.
    """
    hit = min(hits_at(planner, state, spec.object, X_WG, margin=0.0), key=lambda hit: hit.distance, default=None)
    if hit is None or hit.distance > -DEEPEST:
        return
    other = hit.a if hit.b == spec.object else hit.b
    cause = f"'{spec.object}' would overlap '{other}' by {readable(-hit.distance, 'm')} at its place"
    hint = (
        f"to set it on top, write `onto: {other}`" if spec.support is None else f"place it elsewhere, or move '{other}'"
    )
    unmoved = planner.body_pose(state, other) is planner.scene.body(other).X_WO
    # What no step has moved does not depend on earlier choices.
    loc = (("at",) if spec.at is not None else (spec.support_key,)) if unmoved else ()
    raise NotPlannable(cause, hint=hint, parts=frozenset((other,)), loc=loc)


def _refuse_fall(spec: PlaceSpec, planner: Planner, state: PlanningState, X_WG: Transform) -> None:
    """Check that something is below a place without a support.

    Raises:
        NotPlannable: it would fall.
    """
    body, inside = planner.scene.body(spec.object), planner.contents(state, spec.object)
    falls = [
        drop_height(body, X_WG, other, planner.body_pose(state, other.name))
        for other in planner.scene.bodies
        if other.name not in (spec.object, *inside)
    ]
    fall = min((height for height in falls if height is not None), default=None)
    if fall is None or fall > MOST_FALL:
        far = "without end" if fall is None else f"by {readable(fall, 'm')}"
        hint = "lower it, or name what it stands on: `onto: BODY`"
        raise NotPlannable(f"'{spec.object}' would fall {far}: nothing is below its place", hint=hint, loc=("at",))


def located(region: RegionSpec, planner: Planner, state: PlanningState) -> Callable[[Spot], Spot]:
    """The map from places in the frame of a region to the world."""
    if region.frame is None:
        return lambda spot: spot
    X_WF = _level(region.frame, planner, state, ("region", "frame"))

    def in_world(spot: Spot) -> Spot:
        x, y, _ = X_WF.apply([*spot, 0.0])
        return float(x), float(y)

    return in_world


def in_region(spec: PlaceSpec, planner: Planner, state: PlanningState, at: Spot) -> Transform:
    """X_WG at a place [x, y] in the world, of a region.

    Raises:
        NotPlannable: it is not on the support.
    """
    frame = None if spec.region is None else spec.region.frame
    yaw = spec.yaw if frame is None else _yaw(spec, planner.frame(frame, state))
    return _on_support(spec, planner, state, at, yaw, word="region")


def _on_support(
    spec: PlaceSpec, planner: Planner, state: PlanningState, at: Spot, yaw: float | None, *, word: str = "at"
) -> Transform:
    assert spec.support is not None  # `check` asks for it
    frame = "world"
    if isinstance(spec.at, RelationSpec):
        frame = spec.at.of
    elif spec.region is not None and spec.region.frame is not None:
        frame = spec.region.frame
    return standing(planner, state, spec.object, spec.support, at, yaw, word, spec.support_key, frame)


def _yaw(spec: PlaceSpec, X_WF: Transform) -> float | None:
    """[rad] in the world of a yaw that refers to a frame; None if the object keeps its own."""
    return None if spec.yaw is None else spec.yaw + heading(X_WF.R)


def _related(spec: PlaceSpec, at: RelationSpec, planner: Planner, state: PlanningState) -> Transform:
    """X_WG of a relation; its height is that of the support, if there is one."""
    X_WF = planner.frame(at.of, state)
    yaw = _yaw(spec, X_WF)
    R = Transform.of(rpy=(0.0, 0.0, heading(planner.body_pose(state, spec.object).R) if yaw is None else yaw)).R
    if at.side is not None:
        X_WG = _beside(spec, at, planner, state, R)
    else:
        part = None if spec.part is None else planner.scene.frame(f"{spec.object}/{spec.part}")
        offset = np.zeros(3) if part is None else R @ part.X_PF.p
        X_WG = Transform.of(xyz=X_WF.apply(at.xyz or ()) - offset, R=R)
    if spec.support is None:
        return X_WG
    x, y, _ = X_WG.p
    return _on_support(spec, planner, state, (float(x), float(y)), heading(R))


def _beside(spec: PlaceSpec, at: RelationSpec, planner: Planner, state: PlanningState, R: Array) -> Transform:
    """X_WG on one side of a body: as high as that, or on a support with a flat top."""
    body, other = planner.scene.body(spec.object), planner.scene.body(at.of)
    X_WU = _level(at.of, planner, state, ("at", "of"))
    low = drop_test.bottom(other, X_WU)
    if spec.support is not None and planner.scene.body(spec.support).kind not in FORMED:
        low = float(planner.body_pose(state, spec.support).p[2]) + floor_of(planner.scene.body(spec.support))[0]
    z = low + float(body.size[2] / 2 - body.centre[2])
    X_WG = beside(body, R, z, other, X_WU, at.side or "", at.gap or 0.0)
    if X_WG is None:
        message = f"'{spec.object}' on '{spec.support}' is not as high as '{at.of}', so no side of it has a gap"
        raise NotPlannable(message, hint="use `at: {of: ..., xyz: ...}`", loc=("at", "side"))
    return X_WG


def _level(name: str, planner: Planner, state: PlanningState, loc: tuple[str, ...]) -> Transform:
    """X_WF of a frame that is upright.

    Raises:
        NotPlannable: it is tilted.
    """
    X_WF = planner.frame(name, state)
    if X_WF.R[2, 2] < UPRIGHT:
        raise NotPlannable(f"'{name}' is tilted, so its sides are not level", hint="use `xyz` instead", loc=loc)
    return X_WF
