"""`pour`: hold a cup over a container, tilt it about a horizontal axis of the hand, wait, and tilt it back.

    - pour: {object: cup, into: tray, tilt: 120 deg, dwell: 1 s}
      until: {inside: {object: ball, of: tray}}
      timeout: 15 s

The lip (the lowest point of the rim when tilted) is placed above the centre of the container, or `offset` before it:
what leaves the cup flies on in the direction w. With c the centre of the
rim, r its radius, a the axis and w = a x z the horizontal direction in which the upright cup tips, all from O in the
world, a rotation R by theta about a puts the lip at

    p_O + R (c + r w) = p_O + (h sin(theta) + r cos(theta)) w + (h cos(theta) - r sin(theta)) z

where the second form is for a rim at the height h above O.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.core.prose import amount, between, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.carrying import carry
from manipcli.plan.claimed_joints import Claims, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.ranges import Range, spread
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.scene.scene import Body, Scene
from manipcli.spec.base import Model
from manipcli.spec.names import ContainerName, MovableName
from manipcli.spec.quantity import Angle, Length, Pause

YAWS_DEG = (0.0, 15.0, -15.0, 30.0, -30.0, 50.0, -50.0, 75.0, -75.0)
"""Candidate rotations of the hand about the vertical, relative to how the cup is held."""
UP = np.array([0.0, 0.0, 1.0])


class PourSpec(Model):
    """Carry a held object over a container, tilt it about a horizontal axis of the hand, wait, and tilt it back.

    A pour of more than 90 deg is done when all that was in the object is in the container, or with `until` when that
    condition holds. A smaller tilt may leave a part in the object.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The held container, which is tilted.")
    into: ContainerName = Field(description="The receiving container.")
    tilt: Annotated[Angle, Field(gt=0, le=math.pi, description="How far to tilt [rad].")] = math.radians(120)
    dwell: Annotated[Pause, Field(ge=0, description="Time to stay tilted [s], at most 1 h; extended by `until`.")] = 1.0
    clearance: Annotated[Range, Field(description="Lip above the receiving rim [m].")] = (0.04, 0.12)
    offset: Length = Field(
        0.0,
        description="How far the lip is before the centre of the receiving rim, against the direction of the pour [m]: "
        "what pours out fast lands further; negative: beyond it.",
    )
    velocity_scaling: VelocityScaling = Field(
        0.5, description="Share of the velocity, acceleration and jerk limits while carrying and tilting."
    )


def candidates(spec: PourSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Heights of the lip, directions of the hand, and both senses of the tilt."""
    planner.held(state, spec.object)
    planner.free_start(state)
    body = planner.scene.body(spec.object)
    X_TO = planner.held_in_tool(state)
    R_WT = _righted(planner.body_pose(state, spec.object).R) @ planner.tool_pose(state).R
    receiver = planner.scene.body(spec.into)
    X_WR = planner.body_pose(state, spec.into)
    mouth = X_WR.apply([receiver.centre[0], receiver.centre[1], receiver.centre[2] + receiver.size[2] / 2])

    contents = planner.contents(state, spec.object)
    poured = frozenset((name, spec.into) for name in contents)

    def attempt(clearance: float, yaw: float, sense: float) -> StepPlan:
        R_WT0 = matrix_from_axis_angle(UP, yaw) @ R_WT
        a = _horizontal_axis(R_WT0)
        theta, w = sense * spec.tilt, sense * np.cross(a, UP)
        lip = mouth + clearance * UP - spec.offset * w
        R_tilt = matrix_from_axis_angle(a, theta)
        p_WT = lip - R_tilt @ (_lip(body, R_WT0 @ X_TO.R, w) + R_WT0 @ X_TO.p)
        builder = MotionBuilder(planner, state, allowed=poured)
        carry(planner, builder, "carry", Transform.of(xyz=p_WT, R=R_WT0), speed=spec.velocity_scaling)
        builder.turn("tilt", a, theta, speed=spec.velocity_scaling)
        builder.dwell("dwell", spec.dwell)
        over = spec.tilt > math.pi / 2
        if over:
            builder.spill(spec.into)
        try:
            builder.back("tilt back", emptied=over and bool(poured))
        except NotPlannable as refusal:
            if not refusal.parts & frozenset(contents):
                raise
            raise refusal.but(hint="pour from higher, `clearance: ...`: what is poured out is in the way") from refusal
        planned = builder.plan()
        return replace(planned, poured=contents, into=spec.into) if over else planned

    ways = itertools.product(spread(spec.clearance), YAWS_DEG, _senses(planner, state, mouth, R_WT))
    options = [
        Candidate(
            partial(attempt, clearance, math.radians(yaw), sense),
            name=f"lip {readable(clearance, 'm')} above the rim, hand turned {yaw:g} deg, tilt {sense:+.0f}",
        )
        for clearance, yaw, sense in ways
    ]
    return Candidates(options, what=f"cannot pour from '{spec.object}' into '{spec.into}'")


def _horizontal_axis(R_WT: Array) -> Array:
    """The first horizontal axis of the tool, z first: the axis of the last joint on most arms."""
    for axis in (R_WT[:, 2], R_WT[:, 0], R_WT[:, 1]):
        if abs(axis[2]) < math.sin(math.radians(10.0)):
            flat = np.array([axis[0], axis[1], 0.0])
            return np.asarray(flat / np.linalg.norm(flat))
    raise NotPlannable("no tool axis is horizontal, so the cup cannot be tilted about it")


def _senses(planner: Planner, state: PlanningState, mouth: Array, R_WT: Array) -> tuple[float, float]:
    """Both senses of rotation; tipping towards the receiver first."""
    w = np.cross(_horizontal_axis(R_WT), UP)
    towards = mouth - planner.tool_pose(state).p
    sense = 1.0 if float(towards @ w) >= 0.0 else -1.0
    return (sense, -sense)


def _lip(body: Body, R_WO: Array, w: Array) -> Array:
    """From O to the lip (3,), in the world, of the upright cup that will tip towards the unit vector `w`."""
    rim = R_WO @ np.array([body.centre[0], body.centre[1], body.centre[2] + body.size[2] / 2])
    radius = float(max(body.size[0], body.size[1]) / 2)
    return np.asarray(rim + radius * w)


def _righted(R_WO: Array) -> Array:
    """The smallest rotation (3, 3), in the world, that makes a tilted cup upright."""
    axis = np.cross(R_WO[:, 2], UP)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    return matrix_from_axis_angle(axis / sine, math.atan2(sine, float(R_WO[2, 2])))


def check(spec: PourSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown bodies, a body poured into itself, or a lip that is not over the container."""
    if spec.object == spec.into:
        return (Problem(loc=("into",), message=f"'{spec.object}' cannot be poured into itself"),)
    found = unknown_body(scene, spec.object, ("object",), movable=True) + unknown_body(scene, spec.into, ("into",))
    if found:
        return found
    reach = float(max(scene.body(spec.into).size[:2]) / 2)
    if abs(spec.offset) < reach:
        return ()
    message = f"the lip is {readable(abs(spec.offset), 'm')} from the centre of '{spec.into}', outside its rim"
    hint = f"'{spec.into}' reaches {readable(reach, 'm')} from its centre"
    return (Problem(loc=("offset",), message=message, hint=hint),)


def uncommanded(spec: PourSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool without a controller."""
    return unmoved_tool(claims, robot, ("object",))


def clause(spec: PourSpec, robot: RobotModel) -> str:
    side = "before" if spec.offset > 0.0 else "beyond"
    offset = f" and {amount(abs(spec.offset), 'm')} {side} its centre" if spec.offset else ""
    return (
        f"pour from {named(spec.object)} into {named(spec.into)}: hold the lip {between(spec.clearance, 'm')} above "
        f"its rim{offset}, tilt it by {amount(spec.tilt, 'rad')}, wait {amount(spec.dwell, 's')}, and "
        f"tilt it back{at_share(spec.velocity_scaling, 0.5)}"
    )


MEMBER = StepMember(
    name="pour", spec=PourSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause
)
