"""Contract of steps: from the predicted state before a step to its motions and the state after it.

Steps are pure: no engine, no clock; randomness comes from the planner's generator. The pipeline turns motions into
controller goals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from manipcli.conditions.condition import Problem
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.motion import PlanningState, StepPlan, Switch
from manipcli.plan.planner import Planner
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model

S = TypeVar("S", bound=Model)


@dataclass(frozen=True, slots=True)
class StepMember(Generic[S]):
    """A member of the seam: the verb in YAML.

    Attributes:
        name: the verb.
        spec: what the user writes under it.
        plan: (spec, planner, state) -> StepPlan. Begins at the state; raises NotPlannable.
        check: (spec, robot, scene) -> the names and values in the spec that do not fit this robot and scene.
        uncommanded: (spec, robot, claims) -> what these controllers cannot carry out; called only if `check` finds
            nothing.
        request: (spec) -> the switch of controllers that it requests, so that later steps are checked against the
            controllers that are then active.
        guarded: (spec) -> whether it stops as soon as the step's `until` holds.
        alternative: (spec, planner, state, grasps) -> as `plan`, with another tool orientation than in any of
            `grasps`, R_WT (3, 3) each; None for a step that does not grasp, or has no other grasp.
    """

    name: str
    spec: type[S]
    plan: Callable[[S, Planner, PlanningState], StepPlan]
    check: Callable[[S, RobotModel, Scene], tuple[Problem, ...]]
    uncommanded: Callable[[S, RobotModel, Claims], tuple[Problem, ...]]
    request: Callable[[S], Switch | None] = lambda _: None
    guarded: Callable[[S], bool] = lambda _: False
    alternative: Callable[[S, Planner, PlanningState, Sequence[Array]], StepPlan] | None = None
