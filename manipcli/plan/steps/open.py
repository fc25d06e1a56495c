"""`open`: take a drawer, a door or a lid by its handle and open it.

- open: {object: drawer, by: 15 cm}
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.core.prose import named
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidates
from manipcli.plan.motion import JointGoal, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember
from manipcli.plan.steps.jointed_goal import (
    WITHIN,
    HandleSpec,
    beyond,
    by_hand,
    check_handle,
    joint_and_handle,
    most,
    moved_joint,
    opening,
    taking,
    travel,
    uncommanded,
)
from manipcli.scene.scene import Scene
from manipcli.spec.quantity import JointValue


class OpenSpec(HandleSpec):
    """Take a drawer, a door or a lid by its handle, move it along the path of its joint, let go, and withdraw.

    The hand keeps its pose in the handle. It is stiff along the path, and yields across it, where the joint guides it.
    The step is done when the joint is open by `by`, less 5 mm or 3 deg; more is done as well. It is refused where the
    joint does not stay there when the hand lets go: a lid that falls back, a door with a spring.
    """

    verb: ClassVar[str] = "open"

    by: Annotated[JointValue, Field(gt=0)] | None = Field(
        None, description="How far from closed [rad or m], above 0. Default: as far as the joint goes."
    )


def candidates(spec: OpenSpec, planner: Planner, state: PlanningState) -> Candidates:
    """The ways to take the handle."""
    joint, handle = joint_and_handle(planner.scene, spec)
    sign = opening(joint)
    target = joint.closed + sign * (most(joint) if spec.by is None else min(spec.by, most(joint)))
    goal = JointGoal(joint.name, target, sign, WITHIN[joint.unit])
    return by_hand(spec, planner, state, joint, handle, goal)


def check(spec: OpenSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """What cannot be opened, or not so far."""
    found, joint = check_handle(spec, robot, scene), moved_joint(scene, spec.object)
    if joint is None:
        return found
    if spec.by is None:
        if math.isfinite(most(joint)):
            return found
        message = f"'{joint.name}' turns without end: how far it opens is not stated"
        return (*found, Problem((), message, "add `by: ...`", code="TASK373"))
    return (*found, *beyond(joint, spec.by, most(joint), "by", "opens"))


def clause(spec: OpenSpec, robot: RobotModel, scene: Scene | None = None) -> str:
    far = "as far as it goes" if spec.by is None else f"by {travel(scene, spec.object, spec.by)}"
    return f"open {named(spec.object)} {far}: {taking(spec)}"


MEMBER = StepMember(
    name="open", spec=OpenSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause,
    scene_clause=clause, compliant=lambda _: True,
)  # fmt: skip
