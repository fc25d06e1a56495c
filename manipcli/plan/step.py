"""Contract of steps: from the predicted state before a step to its motions and the state after it.

Steps are pure: no engine, no clock; randomness comes from the planner's generator. The pipeline turns motions into
controller goals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Literal, TypeVar

from manipcli.conditions.condition import Problem
from manipcli.core.errors import NotPlannable
from manipcli.core.work import WorkSpent
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates, first
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.motion import PlanningState, StepPlan, Switch
from manipcli.plan.planner import NOTHING, Pairs, Planner
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model

S = TypeVar("S", bound=Model)
Part = Literal["arm", "hand", "both", "nothing"]
"""What a step moves."""


def single(
    plan: Callable[[S, Planner, PlanningState], StepPlan],
) -> Callable[[S, Planner, PlanningState], Candidates]:
    """The candidates of a step that can be done in one way only."""
    return lambda spec, planner, state: Candidates([Candidate(lambda: plan(spec, planner, state))])


@dataclass(frozen=True, slots=True)
class StepMember(Generic[S]):
    """A member of the seam: the verb in YAML.

    Attributes:
        name: the verb.
        spec: what the user writes under it.
        candidates: (spec, planner, state) -> the ways to do it from this state, lazily, the preferred first; raises
            NotPlannable where there is none for a reason that all share.
        check: (spec, robot, scene) -> the names and values in the spec that do not fit this robot and scene.
        uncommanded: (spec, robot, claims) -> what these controllers cannot carry out; called only if `check` finds
            nothing.
        clause: (spec, robot) -> the step in English, as an order without a capital and a full stop: `lift 'cup' by 8 to
            20 cm`. `core/prose.py` has the parts.
        scene_clause: (spec, robot, scene) -> the same with what only the scene says, such as the units of its joints;
            None: `clause`.
        request: (spec) -> the switch of controllers that it requests, so that later steps are checked against the
            controllers that are then active.
        guarded: (spec) -> whether it stops as soon as the step's `until` holds.
        compliant: (spec) -> whether its motions have a `compliance`, so that the arm needs a compliant controller.
        moves: whether it moves the arm, so that `keep` means something.
        part: (spec, robot, joints of the hand) -> what it moves, for a `parallel`; `both` also for what needs the hand
            at a place.
    """

    name: str
    spec: type[S]
    candidates: Callable[[S, Planner, PlanningState], Candidates]
    check: Callable[[S, RobotModel, Scene], tuple[Problem, ...]]
    uncommanded: Callable[[S, RobotModel, Claims], tuple[Problem, ...]]
    clause: Callable[[S, RobotModel], str]
    scene_clause: Callable[[S, RobotModel, Scene], str] | None = None
    request: Callable[[S], Switch | None] = lambda _: None
    guarded: Callable[[S], bool] = lambda _: False
    compliant: Callable[[S], bool] = lambda _: False
    moves: bool = True
    part: Callable[[S, RobotModel, Sequence[str]], Part] = lambda *_: "both"

    def told(self, spec: S, robot: RobotModel, scene: Scene) -> str:
        """The step in English; see `clause`."""
        return self.clause(spec, robot) if self.scene_clause is None else self.scene_clause(spec, robot, scene)

    def plan(self, spec: S, planner: Planner, state: PlanningState) -> StepPlan:
        """The plan of the first candidate that has one, with straight paths only.

        Raises:
            NotPlannable: none has.
        """
        return first(self.candidates(spec, planner, state))

    def ways(self, spec: S, planner: Planner, state: PlanningState, allowed: Pairs = NOTHING) -> Candidates:
        """The candidates with straight paths; then, if a free motion was obstructed, those with searched paths.

        `allowed`: pairs of parts that may touch.
        """
        straight = planner.allowing(allowed)

        def around() -> Candidates | None:
            view = straight.searching_paths()
            return None if view is None else _explaining(self.candidates(spec, view, state))

        return replace(_explaining(self.candidates(spec, straight, state)), further=around)


def _explaining(candidates: Candidates) -> Candidates:
    """The same candidates, whose refusal keeps its hint where the budget does not suffice for a better one."""

    def explain(refusal: NotPlannable) -> NotPlannable:
        try:
            return candidates.explain(refusal)
        except WorkSpent:
            return refusal

    return replace(candidates, explain=explain)
