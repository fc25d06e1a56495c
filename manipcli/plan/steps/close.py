"""`close`: push a drawer, a door or a lid closed at its handle, or take it by the handle.

- close: {object: drawer}
"""

from __future__ import annotations

from typing import ClassVar

from manipcli.core.prose import named
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidates
from manipcli.plan.motion import JointGoal, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember
from manipcli.plan.steps.jointed_goal import (
    WITHIN,
    HandleSpec,
    by_hand,
    check_handle,
    joint_and_handle,
    opening,
    taking,
    uncommanded,
)


class CloseSpec(HandleSpec):
    """Move a drawer, a door or a lid along the path of its joint to where it is closed, and withdraw.

    The closed hand pushes the handle; where the arm cannot follow that path, it takes the handle. What is in the link
    or on it moves along. The step is done when the joint is within 5 mm or 3 deg of where it is closed.
    """

    verb: ClassVar[str] = "close"


def candidates(spec: CloseSpec, planner: Planner, state: PlanningState) -> Candidates:
    """The ways to take the handle."""
    joint, handle = joint_and_handle(planner.scene, spec)
    goal = JointGoal(joint.name, joint.closed, -opening(joint), WITHIN[joint.unit])
    return by_hand(spec, planner, state, joint, handle, goal, push=True)


def clause(spec: CloseSpec, robot: RobotModel) -> str:
    pushing = f"push its part {named(spec.part)} with the closed hand along the path of the joint"
    return f"close {named(spec.object)}: {pushing}; or, where the arm cannot follow, {taking(spec)}"


MEMBER = StepMember(
    name="close", spec=CloseSpec, candidates=candidates, check=check_handle, uncommanded=uncommanded, clause=clause,
    compliant=lambda _: True,
)  # fmt: skip
