"""Geometric planners of OMPL (Sucan, Moll and Kavraki, IEEE RAM 19(4), 2012), from its own wheel: an optional member.

OMPL's random generators are global in the process, and their seed is fixed by the first one: the same file gives the
same path only as the first plan of a process of the same version. Bytes are not promised.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any, Literal

import numpy as np
from pydantic import Field

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.core.work import WorkSpent
from manipcli.plan.path_planner import PathFailure, PathPlannerMember, PathProblem
from manipcli.spec.planner import PlannerSpec

INSTALL = "run `pip install 'manipcli[ompl]'`, or use `planner: {type: rrt_connect}`"


class OmplSpec(PlannerSpec):
    """A geometric planner of OMPL. Needs the extra `manipcli[ompl]`; equal bytes are not promised.

    `samples` counts the edges that it checks, or the configurations where they are more. An optimising planner
    (`BITstar`, `RRTstar`, ...) uses all of them.
    """

    type: Literal["ompl"] = Field("ompl", description="For OMPL's planners.")
    algorithm: str = Field(
        "RRTConnect", description="A planner of `ompl.geometric`: `RRTConnect`, `BITstar`, ... Default RRTConnect."
    )


class Ompl:
    """The planner, with its settings."""

    def __init__(self, spec: OmplSpec) -> None:
        self._spec = spec

    def plan(self, problem: PathProblem, rng: np.random.Generator) -> Array | PathFailure:
        """See `PathPlanner.plan`.

        Raises:
            NotPlannable: OMPL is not installed, has no such planner, or cannot keep constraints.
        """
        base, geometric, util = _libraries()
        made = getattr(geometric, self._spec.algorithm, None)
        known = sorted(name for name, kind in vars(geometric).items() if _plans(kind, base))
        if made is None or not _plans(made, base):
            near = did_you_mean(self._spec.algorithm, known, kind="planners", most=4)
            raise NotPlannable(f"OMPL has no planner '{self._spec.algorithm}'", hint=near)
        if problem.project is not None:
            raise NotPlannable(
                "OMPL's planners do not keep constraints on the path", hint="use `planner: {type: rrt_connect}`"
            )
        util.setLogLevel(util.LOG_NONE)
        util.RNG.setSeed(int(rng.integers(1, 2**31)))
        si, checked = space(base, problem)
        most = self._spec.samples
        definition = base.ProblemDefinition(si)
        definition.addStartState(_state(si, problem.start))
        goals = base.GoalStates(si)
        for goal in problem.goals:
            goals.addState(_state(si, goal))
        definition.setGoal(goals)
        planner = made(si)
        planner.setProblemDefinition(definition)
        planner.setup()
        # A sampler that finds no free configuration checks no edge.
        planner.solve(base.PlannerTerminationCondition(lambda: checked["spent"] > 0 or max(checked.values()) >= most))
        if definition.hasExactSolution():
            return np.array([_array(state, len(problem.start)) for state in definition.getSolutionPath().getStates()])
        away = np.linalg.norm(problem.goals - problem.start, axis=1)
        count = max(checked.values())
        why = f"OMPL's {self._spec.algorithm} found no path with {count} checked edges"
        return PathFailure(why, count, problem.start, problem.goals[int(np.argmin(away))])


def space(base: ModuleType, problem: PathProblem) -> tuple[Any, dict[str, int]]:
    """OMPL's `SpaceInformation` of a problem, and its counters of checked edges and configurations.

    `spent` counts those that were not checked, as the work budget was spent; no exception passes through OMPL.
    """
    n = len(problem.start)
    bounds = base.RealVectorBounds(n)
    for k in range(n):
        bounds.setLow(k, float(problem.lower[k]))
        bounds.setHigh(k, float(problem.upper[k]))
    states = base.RealVectorStateSpace(n)
    states.setBounds(bounds)
    si = base.SpaceInformation(states)
    checked = {"edges": 0, "configurations": 0, "spent": 0}

    def within_budget(check: Callable[[], bool]) -> bool:
        try:
            return check()
        except WorkSpent:
            checked["spent"] += 1
            return False

    def valid(state: Any) -> bool:
        checked["configurations"] += 1
        return within_budget(lambda: problem.valid(_array(state, n)))

    class Edges(base.MotionValidator):  # type: ignore[misc, name-defined]
        def checkMotion(self, a: Any, b: Any, _last: Any = None) -> bool:
            checked["edges"] += 1
            end = _array(b, n)
            return within_budget(lambda: problem.valid(end) and problem.edge(_array(a, n), end))

    si.setStateValidityChecker(valid)
    si.setMotionValidator(Edges(si))
    si.setup()
    return si, checked


def _libraries() -> tuple[ModuleType, ModuleType, ModuleType]:
    try:
        from ompl import base, geometric, util
    except ImportError as error:
        raise NotPlannable("the planner `ompl` needs the extra 'ompl'", hint=INSTALL) from error
    return base, geometric, util


def _plans(kind: object, base: ModuleType) -> bool:
    return isinstance(kind, type) and issubclass(kind, base.Planner)


def _state(si: Any, q: Array) -> Any:
    state = si.allocState()
    for k, value in enumerate(q.tolist()):
        state[k] = value
    return state


def _array(state: Any, n: int) -> Array:
    return np.array([state[k] for k in range(n)])


MEMBER = PathPlannerMember(name="ompl", spec=OmplSpec, make=Ompl)
