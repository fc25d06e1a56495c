"""`grasp`: close the hand until each finger meets the stated force.

- grasp: {object: cup, posture: wrap, force: 8 N}
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.prose import amount, named
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unmoved_hand, unmoved_tool
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.names import MovableName, PoseName
from manipcli.spec.quantity import Force

DEFAULT_FORCE = 8.0


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


def plan(spec: GraspSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """One motion of the hand.

    Raises:
        NotPlannable: the hand already holds something, or does not touch the object.
    """
    if spec.object is not None:
        planner.free_hand(state, spec.object)
    builder = MotionBuilder(planner, state)
    builder.close(spec.posture, force=spec.force, must_hold=spec.until == "contact", body=spec.object)
    return builder.plan()


def check(spec: GraspSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown object or posture."""
    found = unknown_posture(robot, spec.posture, ("posture",))
    return found if spec.object is None else found + unknown_body(scene, spec.object, ("object",), movable=True)


def uncommanded(spec: GraspSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A hand or, with an object, a tool without a controller."""
    tool = () if spec.object is None else unmoved_tool(claims, robot, ("object",))
    return tool + unmoved_hand(claims, robot, spec.posture, ("posture",))


def clause(spec: GraspSpec, robot: RobotModel) -> str:
    what = "" if spec.object is None else f" around {named(spec.object)}"
    until = ", or until it reaches that pose" if spec.until == "posture" else ""
    return (
        f"close the hand{what} towards its pose {named(spec.posture)} until each finger presses with "
        f"{amount(spec.force, 'N')}{until}"
    )


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
