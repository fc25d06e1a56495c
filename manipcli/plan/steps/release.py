"""`release`: open the hand.

- release: {posture: open}
"""

from __future__ import annotations

from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.core.prose import named
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unmoved_hand
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.names import PoseName


class ReleaseSpec(Model):
    """Open the hand to a named pose and let go; the step fails if something stops the hand, or if it still holds."""

    posture: PoseName = Field("open", description="The named pose that the hand opens to.")


def plan(spec: ReleaseSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """One motion of the hand."""
    builder = MotionBuilder(planner, state)
    builder.open(spec.posture, must_arrive=True)
    return builder.plan()


def check(spec: ReleaseSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown posture."""
    return unknown_posture(robot, spec.posture, ("posture",))


def uncommanded(spec: ReleaseSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A hand without a controller."""
    return unmoved_hand(claims, robot, spec.posture, ("posture",))


def clause(spec: ReleaseSpec, robot: RobotModel) -> str:
    return f"open the hand to its pose {named(spec.posture)} and let go"


MEMBER = StepMember(
    name="release",
    spec=ReleaseSpec,
    candidates=single(plan),
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    moves=False,
    part=lambda *_: "hand",
)
