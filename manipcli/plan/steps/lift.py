"""`lift`: raise a held object straight up.

- lift: {object: cup, by: [8 cm, 20 cm]}
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, ClassVar

from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Transform
from manipcli.core.prose import between, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.claimed_joints import Claims, unmoved_tool
from manipcli.plan.clauses import at_share
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.ranges import Range, spread
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.names import MovableName

_LESS = "lift it less, `by: ...`; or use another grasp: `approach: {yaw: ...}` of its `pick`"


class LiftSpec(Model):
    """Raise a held object straight up, by a height in a range whose middle is tried first.

    This step, like all steps that end with an object in the hand, is done when the hand still presses on the object,
    and the object has followed at least half of the hand's motion and rotation. It may pivot about the direction in
    which the fingers close.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The held object to lift.")
    by: Annotated[Range, Field(description="Height [m].")] = (0.08, 0.2)
    velocity_scaling: VelocityScaling = 0.5


def candidates(spec: LiftSpec, planner: Planner, state: PlanningState) -> Candidates:
    """Straight lines of the tool, its orientation kept, to several heights."""
    planner.held(state, spec.object)
    under = planner.touching(state, spec.object)

    def attempt(height: float) -> StepPlan:
        builder = MotionBuilder(planner, state, verb="lift")
        up = Transform.of(xyz=(0.0, 0.0, height))
        try:
            builder.straight("lift", up @ planner.tool_pose(state), speed=spec.velocity_scaling, allowed=under)
        except NotPlannable as refusal:
            raise refusal.but(hint=_LESS if refusal.reason == "line" else None) from refusal
        return builder.plan()

    options = [Candidate(partial(attempt, height), name=readable(height, "m")) for height in spread(spec.by)]
    return Candidates(options, what=f"cannot lift '{spec.object}'")


def check(spec: LiftSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown object."""
    return unknown_body(scene, spec.object, ("object",), movable=True, carried=True)


def uncommanded(spec: LiftSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """A tool without a controller."""
    return unmoved_tool(claims, robot, ("object",))


def clause(spec: LiftSpec, robot: RobotModel) -> str:
    return f"lift {named(spec.object)} straight up by {between(spec.by, 'm')}{at_share(spec.velocity_scaling, 0.5)}"


MEMBER = StepMember(
    name="lift", spec=LiftSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause
)
