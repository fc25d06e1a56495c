"""`push`: slide a body over what it stands on, with the closed hand behind it.

    - push: {object: box, by: 10 cm, direction: [0, 1]}
    - push: {object: box, onto: mark, force: 20 N}

The hand goes behind the body, in line with its middle and flat on its face, and on in the direction. The arm is a
spring along it: the reference goes further than the body, by force / stiffness. The motion ends as soon as the tool has
gone the distance, and fails when more than `force` is felt for 50 ms.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Final

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.prose import amount, named, point
from manipcli.core.units import readable
from manipcli.model.grasp import friction_coefficient
from manipcli.model.robot import RobotModel
from manipcli.plan.arm_force import refuse_too_strong
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.compliance import FIRM, Beyond, Compliance, compliant
from manipcli.plan.contact_line import HOVER, ahead, travel_to
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.prediction import put
from manipcli.plan.sliding import LEVEL, refuse_step_up, refuse_too_heavy, step_up
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.names import BodyName, MovableName, PoseName
from manipcli.spec.quantity import Force, Length

BEHIND: Final = 0.06
"""[m] Gap between the body's outline and the tool, from which the hand comes straight on."""
HEIGHTS: Final = (0.5, 0.35, 0.7, 0.9)
"""Of the tool above the bottom of the body, as shares of its height."""
FARTHEST: Final = 0.38
"""[m] From there on it does not look for the body any more."""
STEADY: Final = 2000.0
"""[N/m] Stiffness along the push."""
PACE: Final = 0.1
"""Share of `velocity_scaling` on the way with the body."""
BACK: Final = 0.03
"""[m] By which the hand backs off."""
ALONG_WAY: Final = 4
"""Places on the way at which the body is examined."""
FLAT: Final = ("box", "tray")
"""Shapes with flat faces."""
UPRIGHT: Final = 0.1
"""Largest vertical part of the unit normal of a face that the hand lies on."""
RESERVE: Final = 0.8
"""Share of the friction between hand and face that a plan uses."""
UP: Final = np.array([0.0, 0.0, 1.0])


class PushSpec(Model):
    """Slide a body over what it stands on, straight, with the closed hand behind it.

    Exactly one of `by`, `to` and `onto` says how far. The body keeps its rotation: the hand is flat on the face of a
    box, and a push further off this face than friction allows is refused. The arm yields along the push, and
    the step fails where more than `force` is felt for 50 ms; no controllers file is needed for it. A push that friction
    under the body stops, mu m g, is refused.

    It is done when the body is measured to be within 1 cm and 10 deg of its goal; it fails if the body needs more than
    `force`.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The body.")
    by: Annotated[Length, Field(gt=0, le=2.0)] | None = Field(None, description="How far, in `direction` [m].")
    direction: tuple[float, float] | None = Field(
        None, description="With `by`: in the world, [x, y] of any length. Default: away from the base of the robot."
    )
    to: tuple[Length, Length] | None = Field(None, description="Where its frame goes, [x, y] in the world [m].")
    onto: BodyName | None = Field(
        None, description="The body over whose middle it goes; its top is level with what the body stands on."
    )
    force: Annotated[Force, Field(gt=0, le=1e4)] = Field(
        30.0, description="Largest force of the hand on it [N], above 0. Default 30 N."
    )
    posture: PoseName = Field("closed", description="The named pose of the hand. Default: `closed`.")
    velocity_scaling: VelocityScaling = Field(
        0.5, description="Share of the velocity, acceleration and jerk limits; a tenth of it while it pushes."
    )

    @model_validator(mode="after")
    def _one_goal(self) -> PushSpec:
        given = [key for key in ("by", "to", "onto") if getattr(self, key) is not None]
        if len(given) != 1:
            found = " and ".join(f"`{key}`" for key in given) or "none"
            raise problem("conflict", f"needs exactly one of `by`, `to` and `onto`, got {found}", at=tuple(given[-1:]))
        if self.direction is not None and self.by is None:
            message = f"`direction` needs `by`; `{given[0]}` sets the direction"
            raise problem("conflict", message, at=("direction",), hint="remove `direction`", key=True)
        if self.direction is not None and not 1e-6 < math.hypot(*self.direction) < 1e6:
            message = f"the direction has length {math.hypot(*self.direction):.3g}"
            raise problem("conflict", message, at=("direction",), hint="for example [1, 0]")
        return self


def way(spec: PushSpec, planner: Planner, state: PlanningState) -> Array:
    """(3,) the level displacement of the body in the world [m]."""
    X_WO = planner.body_pose(state, spec.object)
    if spec.by is not None:
        along = np.array(spec.direction) if spec.direction else X_WO.p[:2] - planner.robot.X_WB.p[:2]
        length = float(np.linalg.norm(along))
        if length < 1e-9:
            raise NotPlannable(f"'{spec.object}' is on the axis of the base", hint="give a `direction: [x, y]`")
        return np.array([*(spec.by / length * along), 0.0])
    if spec.to is not None:
        goal, here = np.array(spec.to), X_WO.p[:2]
    else:
        body, under = planner.scene.body(spec.object), planner.scene.body(str(spec.onto))
        goal = planner.body_pose(state, under.name).apply(under.centre)[:2]
        here = X_WO.apply(body.centre)[:2]
    return np.array([*(goal - here), 0.0])


def candidates(spec: PushSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Heights of the hand, and its rotations about the vertical: with its broad side to the body first."""
    if state.carried is not None:
        planner.free_hand(state, spec.object)
    planner.free_start(state)
    shift = way(spec, planner, state)
    distance = float(np.linalg.norm(shift))
    if distance < 1e-3:
        raise NotPlannable(f"'{spec.object}' is there already: the way is {readable(distance, 'm')}")
    axis = shift / distance
    if spec.onto is not None:
        refuse_step_up(planner, state, spec.object, spec.onto)
    refuse_too_heavy(planner, state, spec.object, axis, spec.force)
    normal = facing(spec, planner, state, axis)
    _refuse_obstructed(spec, planner, state, shift)
    body, X_WO = planner.scene.body(spec.object), planner.body_pose(state, spec.object)
    middle = X_WO.apply(body.centre)
    half = np.abs(X_WO.R) @ body.size / 2.0
    outline = float(np.hypot(half[0] * axis[0], half[1] * axis[1])) if abs(X_WO.R[2, 2]) > 0.99 else float(half.max())

    def attempt(share: float, turn: float) -> StepPlan:
        start = middle - (outline + BEHIND) * axis + (2.0 * share - 1.0) * half[2] * UP
        side, along_face = np.cross(UP, axis), np.cross(UP, normal)
        c, s = math.cos(turn), math.sin(turn)
        y = c * along_face + s * normal  # of the tool: the fingers are broad along it
        R = np.column_stack([np.cross(y, -UP), y, -UP])
        builder = MotionBuilder(planner, state, verb="push")
        builder.reach("behind", Transform.of(xyz=start, R=R), speed=spec.velocity_scaling, hand=spec.posture, free=True)
        refuse_too_strong(planner, builder.now.position, axis, spec.force)
        X_WA = planner.tool_pose(builder.now)
        near = travel_to(planner, builder.now, spec.object, X_WA, axis, left=HOVER, most=FARTHEST)
        end = near + distance + HOVER
        builder.straight("approach", ahead(X_WA, near, axis), speed=spec.velocity_scaling)
        slack = spec.force / STEADY
        stuck = f"'{spec.object}' did not go {readable(distance, 'm')}: it needs more than {readable(spec.force, 'N')}"
        beyond = Beyond(frozen(axis), float(axis @ X_WA.p) + end, most=spec.force, otherwise=stuck)
        X_TC = Transform.of(R=X_WA.R.T @ np.column_stack([axis, side, UP]))
        law = Compliance.of(along=STEADY, across=FIRM, axis="x", X_TC=X_TC)
        allowed = planner.hand_contacts(spec.object)
        with compliant(builder, replace(law, until=beyond)):
            builder.straight(
                "push", ahead(X_WA, end + slack, axis), speed=PACE * spec.velocity_scaling, allowed=allowed
            )
        moved = Transform.of(xyz=shift) @ X_WO
        with compliant(builder, replace(law, relative=True)):
            builder.straight(
                "back off", ahead(X_WA, end - BACK, axis), speed=spec.velocity_scaling / 2.0, allowed=allowed
            )
        planned = builder.plan()
        motions = tuple(replace(motion, awaits=False) for motion in planned.motions)
        now = put(planner, planned.end, _carried(planner, state, spec.object, moved))
        return StepPlan(motions, now, placed=spec.object)

    ways = itertools.product(HEIGHTS, (0.0, math.pi, math.pi / 2.0, -math.pi / 2.0))
    options = [
        Candidate(
            partial(attempt, share, turn),
            name=f"at {100.0 * share:.0f} % of its height, hand turned {math.degrees(turn):.0f} deg",
        )
        for share, turn in ways
    ]
    return Candidates(options, what=f"cannot push '{spec.object}'")


def facing(spec: PushSpec, planner: Planner, state: PlanningState, axis: Array) -> Array:
    """(3,) horizontal unit vector into the face that the hand lies flat on; of other shapes than boxes the direction.

    Raises:
        NotPlannable: the direction is outside the cone of friction about it: the hand would slide along the face, and
            the body rotate.
    """
    body = planner.scene.body(spec.object)
    if body.kind not in FLAT:
        return axis
    columns = planner.body_pose(state, spec.object).R.T
    normals = [sign * column for column in columns if abs(column[2]) < UPRIGHT for sign in (1.0, -1.0)]
    normal = max(normals, key=lambda each: float(each @ axis), default=axis)
    cone = math.atan(RESERVE * friction_coefficient(planner.robot, body))
    off = math.acos(min(1.0, float(normal @ axis)))
    if off > cone:
        message = f"'{spec.object}' would rotate: the push is {readable(off, 'rad')} off its face"
        limit = f"friction keeps the hand on the face up to {readable(cone, 'rad')}"
        raise NotPlannable(f"{message}, {limit}", hint="push it along its faces, in two steps")
    return np.array([normal[0], normal[1], 0.0]) / math.hypot(normal[0], normal[1])


def _carried(planner: Planner, state: PlanningState, name: str, X_WO: Transform) -> dict[str, Transform]:
    """The poses of a body at X_WO, and of what is in it."""
    shift = X_WO @ planner.body_pose(state, name).inverse()
    inside = {body: shift @ planner.body_pose(state, body) for body in planner.contents(state, name)}
    return {name: X_WO, **inside}


def _refuse_obstructed(spec: PushSpec, planner: Planner, state: PlanningState, shift: Array) -> None:
    """
    Raises:
        NotPlannable: the body would meet another on its way, which it does not touch now; over what is level with its
            support it slides.
    """
    X_WO = planner.body_pose(state, spec.object)
    free = {name for pair in planner.touching(state, spec.object) for name in pair}
    free |= {spec.object, str(spec.onto), *planner.contents(state, spec.object)}
    for k in range(1, ALONG_WAY + 1):
        there = put(planner, state, {spec.object: Transform.of(xyz=k / ALONG_WAY * shift) @ X_WO})
        for pair in sorted(planner.touching(there, spec.object)):
            other = next((name for name in pair if name not in free), None)
            if other is not None and step_up(planner, state, spec.object, other) > LEVEL:
                hint = f"move '{other}' away, or push it less far"
                raise NotPlannable(f"'{other}' is in the way of '{spec.object}'", hint=hint, parts=frozenset((other,)))


def check(spec: PushSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown bodies and postures; a body pushed onto itself."""
    found = unknown_body(scene, spec.object, ("object",), movable=True)
    found += unknown_posture(robot, spec.posture, ("posture",))
    if spec.onto is not None:
        found += unknown_body(scene, spec.onto, ("onto",))
        if spec.onto == spec.object:
            found += (Problem(("onto",), f"'{spec.object}' cannot be pushed onto itself", "name another body"),)
    return found


def uncommanded(spec: PushSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool or a hand without a controller."""
    return unmoved_tool(claims, robot, ("object",)) + unmoved_hand(claims, robot, spec.posture, ("posture",))


def clause(spec: PushSpec, robot: RobotModel) -> str:
    if spec.by is not None:
        where = "away from the robot" if spec.direction is None else f"in the direction {point(spec.direction, '')}"
        goal = f"by {amount(spec.by, 'm')} {where}"
    elif spec.to is not None:
        goal = f"to {point(spec.to)}"
    else:
        goal = f"onto {named(str(spec.onto))}"
    return (
        f"push {named(spec.object)} {goal} with the hand in its pose {named(spec.posture)}, with at most "
        f"{amount(spec.force, 'N')}{at_share(spec.velocity_scaling, 0.5)}"
    )


MEMBER = StepMember(
    name="push",
    spec=PushSpec,
    candidates=candidates,
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    compliant=lambda _: True,
)
