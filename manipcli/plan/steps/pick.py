"""`pick`: reach an object, approach it straight, and close the hand on it.

- pick: {object: cup, approach: {from: side, distance: [8 cm, 14 cm]}, grasp: {posture: wrap, force: 8 N}}
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Literal, get_args

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates, first
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import CLEARANCE, Planner
from manipcli.plan.ranges import Range, spread
from manipcli.plan.step import StepMember
from manipcli.plan.steps.grasp import GraspSpec
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.tool_axes import misplaced, too_wide
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.quantity import Length, Turn

YAWS_DEG = (0.0, 15.0, -15.0, 35.0, -35.0)
"""Candidate rotations of the approach about the vertical, relative to the straight line from robot to object."""
UPRIGHT = 0.99
"""Cosine above which two axes count as parallel: upright objects, tools that point straight down."""
ALIKE = 0.5
"""Cosine above which two tool directions are similar enough to compare their rotation about them."""
SLOPES_DEG = (0.0, 30.0, 60.0)
"""Candidate slopes of the straight approach: along the hand's axis, or from above it, which folds the arm less."""
HIGHER = (2 / 3, 5 / 6)
"""Shares of an object's height at which it is grasped from above if its middle is out of reach: the palm touches."""

_OTHERWISE = (
    "change the approach, the height of the grasp or the opening of the hand: "
    "`approach: {from: ..., yaw: ...}`, `grasp: {height: ...}`, `open: ...`"
)
_HIGHER = "grasp the object where the closing fingers have room, for example higher: `grasp: {height: ...}`"
_AIM = (
    "check `tool: {link: ..., pose: {rpy: ...}}` in the robot file: the tool's +z must point to the object, "
    "and the arm cannot reach that orientation"
)


Direction = Literal["side", "top"]


class ApproachSpec(Model):
    """From where the hand comes."""

    from_: Direction | None = Field(
        None,
        alias="from",
        description="`side`: horizontally, `top`: from straight above. Default: from the side if possible, else from "
        "the top; with `yaw`: from the side.",
    )
    yaw: Turn | None = Field(
        None,
        description="Direction of the approach about the vertical [rad]; from the top: the yaw of the hand. Default: "
        "away from the robot's base; from the top: the yaw of the object, plus quarter turns.",
    )
    distance: Annotated[Range, Field(description="Length of the straight approach [m].")] = (0.08, 0.14)

    @property
    def direction(self) -> Direction | None:
        """From where the hand comes; None if not set."""
        return "side" if self.from_ is None and self.yaw is not None else self.from_


class PickGraspSpec(GraspSpec):
    """The grasp of a pick; the object is that of the pick."""

    object: None = Field(None, description="Not allowed: the pick has the object.")
    height: Length | None = Field(
        None,
        description="Of the tool above the object's bottom [m]. Default: its middle; from the top higher, if that is "
        "out of reach.",
    )


class PickSpec(Model):
    """Open the hand, reach an object, approach it straight, and close the hand on it.

    The tool's +z is the direction of approach, its y the direction in which the fingers close. If a later step cannot
    be planned with this grasp, other grasps are tried, as far as `approach` leaves them open: from the other side, with
    the hand rotated by half a turn, from above.
    """

    renamed: ClassVar = RENAMED

    object: str = Field(description="The object to pick.")
    approach: ApproachSpec = Field(ApproachSpec(), description="From where the hand comes.")
    grasp: PickGraspSpec = Field(PickGraspSpec(), description="How the hand closes.")
    open: str = Field("open", description="The pose of the hand while approaching.")
    velocity_scaling: VelocityScaling = Field(
        1.0,
        description="Share of the velocity, acceleration and jerk limits while reaching; the approach uses half.",
    )


def candidates(spec: PickSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Directions, heights and rolls of the hand, distances and slopes of the approach.

    Raises:
        NotPlannable: the hand already holds something.
    """
    planner.free_hand(state, spec.object)
    before = _clear(spec, planner, state)
    state = before.end
    planner.free_start(state)
    X_WO = planner.body_pose(state, spec.object)
    body = planner.scene.body(spec.object)
    bottom = body.centre[2] - body.size[2] / 2
    height = body.centre[2] if spec.grasp.height is None else bottom + spec.grasp.height
    rotations = _orientations(spec.approach, X_WO, planner.robot.X_WB, planner.tool_pose(state).R)
    goals = [(height, R_WT) for R_WT in rotations]
    if spec.grasp.height is None and body.kind != "sphere" and X_WO.R[2, 2] > UPRIGHT:
        from_above = [R_WT for R_WT in rotations if R_WT[2, 2] < -UPRIGHT]
        goals += [(bottom + share * body.size[2], R_WT) for share in HIGHER for R_WT in from_above]
    out_of_reach: dict[int, NotPlannable | None] = {}

    def tool_at(k: int) -> Transform:
        height, R_WT = goals[k]
        return Transform.of(xyz=X_WO.apply([body.centre[0], body.centre[1], height]), R=R_WT)

    def attempt(k: int, distance: float, slope: float) -> StepPlan:
        X_WG = tool_at(k)
        builder = MotionBuilder(planner, state)
        if k not in out_of_reach:  # checked once: it does not depend on distance and slope
            out_of_reach[k] = builder.unreachable("approach", X_WG, hand=spec.open)
        refusal = out_of_reach[k]
        if refusal is not None:
            hint = f"move '{spec.object}', or {_OTHERWISE}"
            if refusal.reason == "orientation":
                others = [word for word in get_args(Direction) if spec.approach.direction not in (None, word)]
                hint = "; or set ".join([_AIM, *(f"`approach: {{from: {word}}}`" for word in others)])
            raise refusal.but(hint=hint)
        builder.reach("reach", backed_off(X_WG, distance, slope), speed=spec.velocity_scaling, hand=spec.open)
        builder.straight("approach", X_WG, speed=spec.velocity_scaling / 2)
        builder.close(
            spec.grasp.posture,
            force=spec.grasp.force,
            must_hold=spec.grasp.until == "contact",
            body=spec.object,
            roomier=_HIGHER,
        )
        planned = builder.plan()
        return replace(planned, motions=(*before.motions, *planned.motions))

    def options() -> Iterator[Candidate]:
        for k, (height, R_WT) in enumerate(goals):
            if k == len(rotations) and all(
                why is not None and why.reason != "touches" for why in out_of_reach.values()
            ):
                return  # a higher grasp is not nearer
            for distance, slope in itertools.product(spread(spec.approach.distance), slopes()):
                name = _name(R_WT, height - bottom, distance, slope)
                yield Candidate(partial(attempt, k, distance, slope), name=name, grasp=R_WT)

    def explain(refusal: NotPlannable) -> NotPlannable:
        amiss = misplaced(planner, state, spec.open, spec.grasp.posture)
        wide = too_wide(planner, state, spec.object, spec.open, [tool_at(k) for k in range(len(rotations))])
        hints = [hint for hint in (amiss or wide, refusal.hint) if hint is not None]
        return refusal.but(hint="; or ".join(hints) or None)

    return Candidates(options(), what=f"cannot pick '{spec.object}'", decides="grasp", explain=explain)


def _name(R_WT: Array, height: float, distance: float, slope: float) -> str:
    """The approach, the height above the object's bottom, and the roll of the hand, as told of a candidate."""
    z = R_WT[:, 2]
    if abs(z[2]) > UPRIGHT:
        side, yaw = "from the top", math.atan2(R_WT[1, 0], R_WT[0, 0])
    else:
        side, yaw = f"from the side{', rolled' if R_WT[2, 0] > 0.0 else ''}", math.atan2(z[1], z[0])
    sloping = f" at a slope of {math.degrees(slope):.0f} deg" if slope else ""
    return (
        f"{side}, yaw {math.degrees(yaw):.0f} deg, {readable(height, 'm')} above its bottom, "
        f"approach of {readable(distance, 'm')}{sloping}"
    )


def _clear(spec: PickSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """Withdrawal from the object if the hand is around it or near it, after a failed grasp; else no motion."""
    if planner.distance(state, spec.object) >= CLEARANCE:
        return StepPlan((), state)

    def attempt(distance: float, slope: float) -> StepPlan:
        builder = MotionBuilder(planner, state)
        builder.open(spec.open, around=spec.object)
        X_WT = backed_off(planner.tool_pose(state), distance, slope)
        builder.withdraw(X_WT, spec.object, speed=spec.velocity_scaling / 2, grazing=True)
        return builder.plan()

    ways = itertools.product(spread(spec.approach.distance), slopes())
    options = [Candidate(partial(attempt, *way)) for way in ways]
    return first(Candidates(options, what=f"cannot withdraw from '{spec.object}'"))


def backed_off(X_WG: Transform, distance: float, slope: float) -> Transform:
    """The tool pose moved back by `distance` [m] along its axis, and up at the `slope` [rad] of that line."""
    up = Transform.of(xyz=(0.0, 0.0, distance * math.tan(slope)))
    return up @ X_WG @ Transform.of(xyz=(0.0, 0.0, -distance))


def slopes() -> tuple[float, ...]:
    """The candidate slopes [rad], the straight one first."""
    return tuple(math.radians(slope) for slope in SLOPES_DEG)


def _orientations(spec: ApproachSpec, X_WO: Transform, X_WB: Transform, R_WT: Array) -> list[Array]:
    """Candidate R_WT (3, 3), the preferred first; each also rotated by half a turn about z.

    The one nearer to the present orientation `R_WT` comes first: it leaves more range of the wrist for later steps.
    """
    found = []
    if spec.direction != "top":
        away = X_WO.p - X_WB.p
        nominal = math.atan2(away[1], away[0]) if spec.yaw is None else spec.yaw
        for offset in YAWS_DEG if spec.yaw is None else (0.0,):
            yaw = nominal + math.radians(offset)
            z = np.array([math.cos(yaw), math.sin(yaw), 0.0])
            x = np.array([0.0, 0.0, -1.0])
            found += _nearer_first(_frame(x, z), _frame(-x, z), R_WT)
    if spec.direction != "side":
        nominal = float(X_WO.rpy[2]) if spec.yaw is None else spec.yaw
        z = np.array([0.0, 0.0, -1.0])
        both = []
        for offset in (0.0, 90.0) if spec.yaw is None else (0.0,):
            yaw = nominal + math.radians(offset)
            x = np.array([math.cos(yaw), math.sin(yaw), 0.0])
            both.append(_nearer_first(_frame(x, z), _frame(-x, z), R_WT))
        found += [pair[k] for k in (0, 1) for pair in both]
    return found


def _nearer_first(first: Array, second: Array, R: Array) -> list[Array]:
    """Both rotations (3, 3), the second first if `R` has about the same z axis and is clearly nearer to the second."""
    alike = first[:, 2] @ R[:, 2] > ALIKE
    return [second, first] if alike and np.sum(second * R) > np.sum(first * R) + 1e-3 else [first, second]


def _frame(x: Array, z: Array) -> Array:
    """The rotation with these two unit axes."""
    return np.column_stack([x, np.cross(z, x), z])


def check(spec: PickSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown object or postures."""
    return (
        unknown_body(scene, spec.object, ("object",), movable=True)
        + unknown_posture(robot, spec.grasp.posture, ("grasp", "posture"))
        + unknown_posture(robot, spec.open, ("open",))
    )


def uncommanded(spec: PickSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool or a hand without a controller."""
    return (
        unmoved_tool(claims, robot, ("object",))
        + unmoved_hand(claims, robot, spec.grasp.posture, ("grasp", "posture"))
        + unmoved_hand(claims, robot, spec.open, ("open",))
    )


MEMBER = StepMember(name="pick", spec=PickSpec, candidates=candidates, check=check, uncommanded=uncommanded)
