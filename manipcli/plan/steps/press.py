"""`press`: press on a body with a force for a while, and back off.

- press: {object: button, force: 10 N, hold: 1 s}
- press: {object: box, force: 20 N, at: [2 cm, 0, 5 cm], direction: [1, 0, 0]}
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.conditions.frames import carrier, unknown_frame
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.prose import amount, named, point
from manipcli.model.robot import RobotModel
from manipcli.plan.arm_force import refuse_too_strong
from manipcli.plan.claimed_joints import Claims, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.compliance import SOFT, Compliance, Pressing, compliant
from manipcli.plan.contact_line import CLOSE, HOVER, approach_speed, effective_mass, hover
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.steps.move import VelocityScaling
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.names import FrameName
from manipcli.spec.quantity import Force, Length, Pause, Speed
from manipcli.spec.robot import Vector3

DOWN: Final = (0.0, 0.0, -1.0)
RISE: Final = 1.0
"""[s] Planned time from the contact to the force."""
AWAY: Final = 0.03
"""[m] By which the hand withdraws."""
RELAX: Final = 0.4
"""[s] In which the force is given up."""


class ForceSpec(Model):
    """Keys of steps that press with a force."""

    object: FrameName = Field(description="The body, or a part of one (`panel/button`).")
    force: Annotated[Force, Field(gt=0, le=1e4)] = Field(description="Of the tool on it [N], above 0.")
    direction: Vector3 = Field(
        DOWN, description="In which the tool presses, in the world; its z axis points there. Default: straight down."
    )
    stiffness: Annotated[float, Field(gt=0, le=1e5)] = Field(
        SOFT, description="Of the arm along the direction [N/m], above 0. Default 400 N/m."
    )
    speed: Annotated[Speed, Field(gt=0, le=0.25)] | None = Field(
        None,
        description="Of the tool just before the contact [m/s]. Default: so slow that the impact of the arm's inertia "
        "on a hard contact does not exceed the force.",
    )
    reach: Annotated[Length, Field(gt=0, le=0.5)] = Field(
        0.02, description="The step fails if the tool meets nothing within this [m]. Default 2 cm."
    )
    velocity_scaling: VelocityScaling = 0.5

    @model_validator(mode="after")
    def _directed(self) -> ForceSpec:
        if not 1e-6 < math.hypot(*self.direction) < 1e6:
            message = f"the direction has length {math.hypot(*self.direction):.3g}"
            raise problem("conflict", message, at=("direction",), hint="straight down is [0, 0, -1]")
        return self

    @property
    def axis(self) -> Array:
        """(3,) unit vector in the world."""
        return np.asarray(np.array(self.direction) / np.linalg.norm(self.direction))


class PressSpec(ForceSpec):
    """Press on a body with a force, hold it, and back off.

    The hand comes with its present pose, or with what it holds, from before the point. The arm is then a soft spring
    along the direction: it approaches slowly, and from the contact on the force rises to its target without exceeding
    it. No controllers file is needed for it.

    It is done when the felt force was within 10 % of `force` for `hold`; it fails if it meets nothing within `reach`,
    or if the body gives way.
    """

    hold: Annotated[Pause, Field(ge=0)] = Field(1.0, description="For how long it presses [s]. Default 1 s.")
    stay: bool = Field(
        False, description="Keep pressing after the step, until the next motion of the arm. Default: back off."
    )
    at: Vector3 | None = Field(
        None, description="The point, in the frame of the body [m]. Default: the middle of its upper face, or the part."
    )


def face(spec: ForceSpec, planner: Planner, state: PlanningState) -> Transform:
    """X_WF of the part that is touched; of a body the middle of its upper face."""
    part = carrier(planner.scene, spec.object) != spec.object
    return planner.frame(spec.object if part else f"{spec.object}/top", state)


def comply(spec: ForceSpec, planner: Planner, q: Array, *, hold: float | None) -> Compliance:
    """The spring and the force of a step at the configuration `q` (n).

    Raises:
        NotPlannable: the arm cannot press so hard there.
    """
    refuse_too_strong(planner, q, spec.axis, spec.force)
    speed = spec.speed
    if speed is None:
        speed = approach_speed(spec.force, effective_mass(planner, q, spec.axis), planner.period)
    force = Pressing(frozen([0.0, 0.0, 1.0]), spec.force, speed, spec.reach, hold=hold)
    return Compliance.of(along=spec.stiffness, force=force)


def press(builder: MotionBuilder, label: str, compliance: Compliance) -> None:
    """Press until the force has been held, from where the tool is."""
    force = compliance.force
    assert force is not None
    with compliant(builder, compliance):
        builder.dwell(label, force.reach / force.speed + RISE + (force.hold or 0.0))


def relax(builder: MotionBuilder, compliance: Compliance) -> None:
    """Give the force up: the tool goes back to where it pressed from."""
    with compliant(builder, replace(compliance, force=None)):
        builder.dwell("back off", RELAX, awaits=False)


def _plan(spec: PressSpec, planner: Planner, state: PlanningState) -> StepPlan:
    builder = MotionBuilder(planner, state, verb="press")
    where, axis = face(spec, planner, state).p, spec.axis
    if spec.at is not None:
        where = planner.frame(spec.object, state).apply(spec.at)
    body = carrier(planner.scene, spec.object)
    X_WH = hover(builder, planner, body, where, axis, speed=spec.velocity_scaling, left=HOVER if spec.stay else CLOSE)
    compliance = comply(spec, planner, builder.now.position, hold=spec.hold)
    press(builder, "press", compliance)
    if spec.stay:
        return builder.plan()
    relax(builder, compliance)
    touching, X_WA = planner.may_touch(builder.now, [body]), Transform.of(xyz=-AWAY * axis) @ X_WH
    builder.straight("withdraw", X_WA, speed=spec.velocity_scaling, allowed=touching)
    return builder.plan()


def check(spec: ForceSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """An unknown body or part."""
    if "/" in spec.object:
        return unknown_frame(robot, scene, spec.object, ("object",))
    return unknown_body(scene, spec.object, ("object",))


def uncommanded(spec: ForceSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool without a controller."""
    return unmoved_tool(claims, robot, ("object",))


def clause(spec: PressSpec, robot: RobotModel) -> str:
    at = "" if spec.at is None else f" at {point(spec.at)}"
    direction = "" if spec.direction == DOWN else f" in the direction {point(spec.direction, '')}"
    text = f"press on {named(spec.object)}{at}{direction} with {amount(spec.force, 'N')} for {amount(spec.hold, 's')}"
    text += " and keep pressing" if spec.stay else ""
    return text + at_share(spec.velocity_scaling, 0.5)


MEMBER = StepMember(
    name="press",
    spec=PressSpec,
    candidates=single(_plan),
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    compliant=lambda _: True,
    part=lambda *_: "arm",
)
