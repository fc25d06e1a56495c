"""`close`: take a drawer, a door or a lid by its handle and close it.

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
    """Take a drawer, a door or a lid by its handle, move it along the path of its joint to where it is closed, let go,
    and withdraw.

    What is in it or on it moves along. The step is done when the joint is within 5 mm or 3 deg of where it is closed.
    """

    verb: ClassVar[str] = "close"


def candidates(spec: CloseSpec, planner: Planner, state: PlanningState) -> Candidates:
    """The ways to take the handle."""
    joint, handle = joint_and_handle(planner.scene, spec)
    goal = JointGoal(joint.name, joint.closed, -opening(joint), WITHIN[joint.unit])
    return by_hand(spec, planner, state, joint, handle, goal, push=True)


def clause(spec: CloseSpec, robot: RobotModel) -> str:
    return f"close {named(spec.object)}: {taking(spec)}"


MEMBER = StepMember(
    name="close", spec=CloseSpec, candidates=candidates, check=check_handle, uncommanded=uncommanded, clause=clause,
    compliant=lambda _: True,
)  # fmt: skip
