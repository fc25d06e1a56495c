"""The contract of steps: from the predicted state before a step to the motions that do it and the one after.

Steps are pure: no engine, no clock; randomness comes from the planner's generator. The pipeline turns Motions into
controller goals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from manipcli.conditions.condition import Problem
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.claims import Claims
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
        check: (spec, robot, scene) -> everything in the spec that this robot and scene do not know.
        uncommanded: (spec, robot, claims) -> everything in it that these controllers cannot carry out; only to be
            asked when `check` finds nothing.
        request: (spec) -> the switch of controllers that it asks for, so that the steps after it are checked against
            who is active then.
        guarded: (spec) -> whether it stops where the step's `until` comes to hold.
        regrasp: (spec, planner, state, grasps) -> as `plan`, with the tool turned to the object in another way than
            in any of `grasps`, R_WT (3, 3) each; None for a step that takes nothing, or in one way only.
    """

    name: str
    spec: type[S]
    plan: Callable[[S, Planner, PlanningState], StepPlan]
    check: Callable[[S, RobotModel, Scene], tuple[Problem, ...]]
    uncommanded: Callable[[S, RobotModel, Claims], tuple[Problem, ...]]
    request: Callable[[S], Switch | None] = lambda _: None
    guarded: Callable[[S], bool] = lambda _: False
    regrasp: Callable[[S, Planner, PlanningState, Sequence[Array]], StepPlan] | None = None
