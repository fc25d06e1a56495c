"""`place`: set a held object down, let go, and withdraw.

- place: {object: cup, at: start}
- place: {object: block, at: [0.5, 0.2], onto: table, yaw: 90 deg}
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import CLEARANCE, Planner
from manipcli.plan.prediction import put
from manipcli.plan.search import Range, first_feasible, spread
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.steps.pick import backed_off, slopes
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.drop_test import FORMED, drop_height
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Cylinder
from manipcli.spec.base import Model
from manipcli.spec.quantity import Length, Turn

UPRIGHT = np.cos(np.radians(5.0))
"""Cosine of the tilt: a body that is more upright than this can be placed on."""
TILTS = tuple(np.radians([0.0, 2.0, 4.0]))
"""Candidate tilts [rad] of the object when it is released."""
ROUND = ("cup", "cylinder", "sphere")
"""Bodies that are as wide along their diagonal as along their axes."""
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
_ROOMIER = "place it where the opening fingers have room, rotate it: `yaw: ...`, or open the hand less: `posture: ...`"


class PlaceSpec(Model):
    """Set down a held object: carry it above its place, lower it straight, let go, and withdraw upwards.

    At [x, y] the object is placed upright, even if it was picked lying. The step fails if the hand does not let go.
    """

    renamed: ClassVar = {**RENAMED, "on": "onto"}

    object: str = Field(description="The held object to set down.")
    at: Literal["start"] | tuple[Length, Length] = Field(
        "start", description="`start`: its pose at the start; or [x, y] in the world, on the body `onto`."
    )
    onto: str | None = Field(
        None,
        description="The supporting body at [x, y]: on its top, or inside a tray; in or on a URDF or a mesh, at the "
        "first contact from above.",
    )
    yaw: Turn | None = Field(None, description="Rotation about the world's z axis, at [x, y] [rad]. Default: as held.")
    clearance: Annotated[Range, Field(description="Height from which it is lowered straight [m].")] = (0.04, 0.1)
    retreat: Annotated[Range, Field(description="Straight withdrawal of the hand [m].")] = (0.12, 0.18)
    posture: str = Field("open", description="The named pose to which the hand opens.")
    velocity_scaling: VelocityScaling = Field(
        0.5, description="Share of the velocity, acceleration and jerk limits while carrying; lowering uses half."
    )


def plan(spec: PlaceSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """The object is placed upright; at [x, y] it keeps its yaw, or gets `yaw`.

    Paths on which the hand withdraws clear of the object are tried first, then those on which it may graze it; only the
    latter if the open hand is too near to it anyway, as around an object that sits deep in the hand. If the arm comes
    too near to something, the object is set down a little tilted, with the arm higher: it rights itself when released.
    """
    planner.held(state, spec.object)
    planner.free_start(state)
    X_WG = _goal(spec, planner, state)
    X_OT = planner.held_in_tool(state).inverse()
    lowered: dict[tuple[float, float], MotionBuilder | NotPlannable] = {}

    def lower(tilt: float, clearance: float) -> MotionBuilder:
        """Carry and lower to the place; planned once for all withdrawals."""
        X_WL = _tilted(planner.scene.body(spec.object), X_WG, X_OT, tilt)
        X_WT = X_WL @ X_OT
        builder = MotionBuilder(planner, state)
        with _hinted(_OVER):
            builder.carry("carry", Transform.of(xyz=(0.0, 0.0, clearance)) @ X_WT, speed=spec.velocity_scaling)
        support = planner.touching(builder.with_body(spec.object, X_WL), spec.object)
        with _hinted(_LOWER):
            builder.straight("lower", X_WT, speed=spec.velocity_scaling / 2, allowed=support)
        return builder

    def attempt(candidate: tuple[float, bool, float, float, float]) -> StepPlan:
        tilt, grazing, clearance, retreat, slope = candidate
        if (tilt, clearance) not in lowered:
            try:
                lowered[tilt, clearance] = lower(tilt, clearance)
            except NotPlannable as refusal:
                lowered[tilt, clearance] = refusal
        down = lowered[tilt, clearance]
        if isinstance(down, NotPlannable):
            raise NotPlannable(down.cause, hint=down.hint)
        builder = down.copy()
        with _hinted(_ROOMIER):
            builder.open(spec.posture, must_arrive=True)
        X_WT = planner.tool_pose(builder.now)
        builder.withdraw(backed_off(X_WT, retreat, slope), spec.object, speed=spec.velocity_scaling, grazing=grazing)
        planned = builder.plan()
        return replace(planned, end=put(planner, planned.end, {spec.object: X_WG}))

    near = planner.distance(MotionBuilder(planner, state).let_go(spec.posture), spec.object) < CLEARANCE
    withdrawals = spread(spec.clearance), spread(spec.retreat), [slopes()[k] for k in (1, 2, 0)]
    tilts = TILTS if X_WG.R[2, 2] > UPRIGHT and _horizontal(X_WG @ X_OT) is not None else TILTS[:1]
    candidates = itertools.product(tilts, (True,) if near else (False, True), *withdrawals)
    return first_feasible(attempt, candidates, what=f"cannot place '{spec.object}'")


@contextmanager
def _hinted(hint: str) -> Iterator[None]:
    """Gives refusals inside this hint for a collision, and a hint on reach for an unreachable line."""
    try:
        yield
    except NotPlannable as refusal:
        better = {"in_the_way": hint, "line": _WITHIN}.get(refusal.reason or "", refusal.hint)
        raise NotPlannable(refusal.cause, hint=better) from refusal


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


def _goal(spec: PlaceSpec, planner: Planner, state: PlanningState) -> Transform:
    """X_WG: the goal pose of the object's frame."""
    body = planner.scene.body(spec.object)
    if spec.at == "start":
        return body.X_WO
    assert spec.onto is not None  # `check` asks for it
    X_WU = planner.body_pose(state, spec.onto)
    under = planner.scene.body(spec.onto)
    if X_WU.R[2, 2] < UPRIGHT:
        raise NotPlannable(f"'{spec.onto}' is tilted; '{spec.object}' cannot be placed on it", loc=("onto",))
    floor, size = _surface(under)
    x, y, _ = X_WU.inverse().apply([*spec.at, 0.0]) - under.centre
    if abs(x) > size[0] / 2 or abs(y) > size[1] / 2:
        raise NotPlannable(
            f"[{spec.at[0]:g}, {spec.at[1]:g}] m is outside '{spec.onto}', whose centre is at "
            f"[{X_WU.p[0]:g}, {X_WU.p[1]:g}] m",
            hint=f"`at` is in the world frame; '{spec.onto}' offers {size[0]:g} m x {size[1]:g} m about its centre",
            loc=("at",),
        )
    bottom = float(body.centre[2] - body.size[2] / 2)
    x_axis = planner.body_pose(state, spec.object).R[:, 0]
    yaw = float(np.arctan2(x_axis[1], x_axis[0])) if spec.yaw is None else spec.yaw
    X_WG = Transform.of(xyz=(*spec.at, X_WU.p[2] + floor - bottom), rpy=(0.0, 0.0, yaw))
    if under.kind not in FORMED:
        return X_WG
    deeper = drop_height(body, X_WG, under, X_WU)
    if deeper is None:
        raise NotPlannable(
            f"no part of '{spec.onto}' is below '{spec.object}' at [{spec.at[0]:g}, {spec.at[1]:g}] m",
            hint=f"choose `at` over a part of '{spec.onto}'",
            loc=("at",),
        )
    return Transform.of(xyz=(0.0, 0.0, -deeper)) @ X_WG


def _surface(under: Body) -> tuple[float, tuple[float, float]]:
    """Height [m] of the supporting surface of a body above its O, and its size (x, y) [m]."""
    if under.interior is None:
        return float(under.centre[2] + under.size[2] / 2), (float(under.size[0]), float(under.size[1]))
    shape, middle = under.interior.shape, float(under.interior.X_OS.p[2])
    if isinstance(shape, Cylinder):
        return middle - shape.length / 2, (2 * shape.radius, 2 * shape.radius)
    return middle - shape.size[2] / 2, shape.size[:2]


def check(spec: PlaceSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown bodies and postures; a place without a support."""
    found = unknown_body(scene, spec.object, ("object",), movable=True)
    found += unknown_posture(robot, spec.posture, ("posture",))
    if spec.onto is not None and spec.onto == spec.object:
        found += (Problem(loc=("onto",), message=f"'{spec.object}' cannot be placed on itself"),)
    elif spec.onto is not None:
        found += unknown_body(scene, spec.onto, ("onto",))
    elif spec.at != "start":
        found += (Problem(loc=("at",), message="`at: [x, y]` needs a supporting body", hint="add `onto: BODY`"),)
    if spec.at == "start":
        found += tuple(
            Problem(
                loc=(word,), message=f"`{word}` needs `at: [x, y]`", hint=f"remove `{word}`: `at: start` sets the pose"
            )
            for word, value in (("onto", spec.onto), ("yaw", spec.yaw))
            if value is not None
        )
    return found


def uncommanded(spec: PlaceSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool or a hand without a controller."""
    return unmoved_tool(claims, robot, ("object",)) + unmoved_hand(claims, robot, spec.posture, ("posture",))


MEMBER = StepMember(name="place", spec=PlaceSpec, plan=plan, check=check, uncommanded=uncommanded)
