"""`grasp`: close the hand until each finger meets the stated force.

- grasp: {object: cup, posture: wrap, force: 8 N}
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import Loc
from manipcli.core.prose import amount, named
from manipcli.model.grasp import friction_coefficient
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.hand import handless
from manipcli.plan.motion import PlanningState, Reflex, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.names import MovableName, PoseName
from manipcli.spec.quantity import Force

DEFAULT_FORCE = 8.0


class ReflexSpec(Model):
    """When the hand presses more, and how much."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="Most of each finger [N], above 0. Default: what the effort limits of the hand allow."
    )
    friction: Annotated[float, Field(gt=0, le=10)] | None = Field(
        None,
        description="Coefficient of friction that the robot believes, above 0 to 10. Default: that of hand and object.",
    )
    onset: float = Field(
        0.8, gt=0, lt=1, description="Share of the friction cone above which it presses more, 0 to 1. Default 0.8."
    )


class GraspSpec(Model):
    """Close the hand until each finger meets `force`; the object is held by friction, or as the tool states.

    With an `object` and `until: contact`, it is done when the hand presses on the object from opposite sides with at
    least 0.1 N; less than `force` is reported. The hand stays closed, even if it met nothing, until `release` or
    `place` opens it.
    """

    object: MovableName | None = Field(None, description="The object to grasp, carried from then on. Default: unknown.")
    posture: PoseName = Field("closed", description="The named pose that the hand closes towards.")
    force: Force = Field(
        DEFAULT_FORCE,
        gt=0,
        description="Contact force at which a finger stops [N]; a position-controlled finger presses with its effort "
        "limit regardless.",
    )
    until: Literal["contact", "posture"] = Field(
        "contact", description="`contact`: fails if no finger touches; `posture`: reaching the posture succeeds, too."
    )
    reflex: bool | ReflexSpec | None = Field(
        None,
        description="Press more while the hand holds and its taxels with `shear` report beginning slip, and keep that "
        "force until the hand opens. Default: false.",
    )

    @model_validator(mode="after")
    def _room_to_press(self) -> GraspSpec:
        most = self.reflex.force if isinstance(self.reflex, ReflexSpec) else None
        if most is not None and most <= self.force:
            message = f"the reflex never presses: its limit of {most:g} N is not above the force of {self.force:g} N"
            raise problem("range", message, at=("reflex", "force"), hint="raise the limit, or lower `force`")
        return self


def plan(spec: GraspSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """One motion of the hand.

    Raises:
        NotPlannable: the hand already holds something, or does not touch the object.
    """
    if spec.object is not None:
        planner.free_hand(state, spec.object)
    builder = MotionBuilder(planner, state)
    close(builder, spec, spec.object)
    return with_reflex(builder.plan(), spec, planner, spec.object)


def close(builder: MotionBuilder, spec: GraspSpec, body: str | None, *, roomier: str = "") -> None:
    """Close the hand on a body; see `MotionBuilder.close`."""
    builder.close(spec.posture, force=spec.force, must_hold=spec.until == "contact", body=body, roomier=roomier)


def with_reflex(plan: StepPlan, spec: GraspSpec, planner: Planner, body: str | None) -> StepPlan:
    """The plan of a grasp of a body, or of something unknown; its closing motions have the reflex of the spec."""
    if not spec.reflex:
        return plan
    given = ReflexSpec() if spec.reflex is True else spec.reflex
    mu = given.friction
    if mu is None:
        assert body is not None  # refused by `check`
        mu = friction_coefficient(planner.robot, planner.scene.body(body))
    reflex = Reflex(mu, given.onset, given.force)
    grips = [None if m.grip is None or m.grip.force is None else replace(m.grip, reflex=reflex) for m in plan.motions]
    motions = (replace(m, grip=grip or m.grip) for m, grip in zip(plan.motions, grips, strict=True))
    return replace(plan, motions=tuple(motions))


def ungripped(spec: GraspSpec, robot: RobotModel, claims: Claims, loc: Loc) -> tuple[Problem, ...]:
    """A problem of a reflex, at `loc`, whose hand cannot change its force."""
    if not spec.reflex:
        return ()
    if handless(robot, spec.posture):
        message = f"robot '{robot.name}' holds without fingers, which have no reflex"
        return (Problem(loc, message, "remove `reflex`"),)
    fixed = [claim for claim in claims.grippers if claim.type != "gripper" or "effort" not in claim.interfaces]
    return tuple(
        Problem(
            loc,
            f"controller {claim.described} cannot change its force: it commands positions, and presses with the effort "
            "limits of its joints",
            "use `command_interface: effort` with gains, or remove `reflex`",
        )
        for claim in fixed
    )


def check(spec: GraspSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown object or posture; a reflex without friction."""
    found = unknown_posture(robot, spec.posture, ("posture",))
    given = spec.reflex is True or (isinstance(spec.reflex, ReflexSpec) and spec.reflex.friction is None)
    if given and spec.object is None:
        hint = "add `object`, or write `reflex: {friction: 0.5}`"
        found += (Problem(("reflex",), "the reflex needs the coefficient of friction: the object is unknown", hint),)
    return found if spec.object is None else found + unknown_body(scene, spec.object, ("object",), movable=True)


def uncommanded(spec: GraspSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A hand or, with an object, a tool without a controller."""
    tool = () if spec.object is None else unmoved_tool(claims, robot, ("object",))
    hand = unmoved_hand(claims, robot, spec.posture, ("posture",))
    return tool + (hand or ungripped(spec, robot, claims, ("reflex",)))


def clause(spec: GraspSpec, robot: RobotModel) -> str:
    what = "" if spec.object is None else f" around {named(spec.object)}"
    until = ", or until it reaches that pose" if spec.until == "posture" else ""
    return (
        f"close the hand{what} towards its pose {named(spec.posture)} until each finger presses with "
        f"{amount(spec.force, 'N')}{until}{pressing_more(spec)}"
    )


def pressing_more(spec: GraspSpec) -> str:
    """`, then with more if it begins to slip`; "" without a reflex."""
    force = spec.reflex.force if isinstance(spec.reflex, ReflexSpec) else None
    most = "" if force is None else f" (up to {amount(force, 'N')})"
    return f", then with more{most} if it begins to slip" if spec.reflex else ""


MEMBER = StepMember(
    name="grasp",
    spec=GraspSpec,
    candidates=single(plan),
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    moves=False,
    part=lambda spec, *_: "hand" if spec.object is None else "both",
)
