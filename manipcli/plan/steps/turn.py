"""`turn`: take a dial, a tap or a valve by its handle and turn it.

- turn: {object: dial, by: 90 deg}
- turn: {object: dial, to: 30 deg}
"""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem
from manipcli.core.errors import NotPlannable
from manipcli.core.prose import amount, named
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidates
from manipcli.plan.jointed import position_of
from manipcli.plan.motion import JointGoal, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember
from manipcli.plan.steps.jointed_goal import (
    ROUNDING,
    WITHIN,
    HandleSpec,
    beyond,
    by_hand,
    check_handle,
    joint_and_handle,
    moved_joint,
    taking,
    uncommanded,
)
from manipcli.scene.scene import Scene
from manipcli.spec.base import problem
from manipcli.spec.quantity import Angle


class TurnSpec(HandleSpec):
    """Take a dial, a tap or a valve by its handle, turn it about the axis of its hinge, let go, and withdraw.

    The step is done when the joint is within 3 deg of the angle.
    """

    verb: ClassVar[str] = "turn"

    by: Angle | None = Field(None, description="From where it is [rad]; negative: the other way.")
    to: Angle | None = Field(None, description="Position of its joint [rad], instead of `by`.")

    @model_validator(mode="after")
    def _one(self) -> TurnSpec:
        if (self.by is None) == (self.to is None):
            message = "expected `by` or `to`" + ("" if self.by is None else ", not both")
            raise problem("conflict", message, at=(), hint="`by: 90 deg` turns it on, `to: 90 deg` turns it to there")
        return self


def candidates(spec: TurnSpec, planner: Planner, state: PlanningState) -> Candidates:
    """The ways to take the handle."""
    joint, handle = joint_and_handle(planner.scene, spec)
    here = position_of(planner, state, joint)
    target = here + (spec.by if spec.by is not None else float(joint.apart(spec.to or 0.0, here)))
    if not joint.lower - ROUNDING <= target <= joint.upper + ROUNDING:
        least, limit = amount(joint.lower, "rad"), amount(joint.upper, "rad")
        message = f"'{joint.name}' turns from {least} to {limit}, not to {amount(target, 'rad')}"
        raise NotPlannable(message, hint=f"it is at {amount(here, 'rad')}: turn it less, or the other way")
    return by_hand(spec, planner, state, joint, handle, JointGoal(joint.name, target, 0.0, WITHIN["rad"]))


def check(spec: TurnSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """What does not turn, or not so far."""
    found, joint = check_handle(spec, robot, scene), moved_joint(scene, spec.object)
    if joint is None:
        return found
    if joint.slides:
        message = f"'{joint.name}' slides: it does not turn"
        return (*found, Problem(("object",), message, "use `open` or `close`", code="TASK375"))
    if spec.by is not None:
        return (*found, *beyond(joint, abs(spec.by), joint.upper - joint.lower, "by", "turns"))
    if spec.to is not None and not joint.lower - ROUNDING <= spec.to <= joint.upper + ROUNDING:
        least, limit = amount(joint.lower, "rad"), amount(joint.upper, "rad")
        message = f"'{joint.name}' turns from {least} to {limit}, not to {amount(spec.to, 'rad')}"
        return (*found, Problem(("to",), message, "set an angle within its limits", code="TASK373"))
    return found


def clause(spec: TurnSpec, robot: RobotModel) -> str:
    far = f"by {amount(spec.by, 'rad')}" if spec.by is not None else f"to {amount(spec.to or 0.0, 'rad')}"
    return f"turn {named(spec.object)} {far}: {taking(spec)}"


MEMBER = StepMember(
    name="turn", spec=TurnSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause,
    compliant=lambda _: True,
)  # fmt: skip
