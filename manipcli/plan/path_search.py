"""Search of a path around obstacles for the arm: the problem, the planner's answer, and why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.work import MARGINS, Work
from manipcli.model.collision import CollisionQuery
from manipcli.model.configuration import position_limits, with_mimics
from manipcli.model.robot import RobotModel
from manipcli.plan.free_space import FreeSpace
from manipcli.plan.kept_problem import LONGEST, Margin, kept_problem
from manipcli.plan.motion import Grip, PlanningState
from manipcli.plan.path_planner import PathFailure, PathProblem
from manipcli.plan.path_planners import PATH_PLANNERS
from manipcli.plan.path_planners.rrt_connect import RrtConnectSpec
from manipcli.plan.path_shortening import shortened
from manipcli.plan.search_progress import PATH_SEARCH
from manipcli.spec.planner import PlannerSpec

STEP = 2
"""A step may use this many times the samples of one search. Each search may use this part of what is left: all for the
first candidate, half for the second, a quarter for the third."""
TELLING = 0.05
"""A search with a smaller share of the samples says nothing about the way: the refusal before it is repeated."""
NARROWEST = 20_000
"""Units of work for the narrowest place and the commonest obstacle, also where the budget is spent."""
_UNLIMITED = np.pi  # rad or m beyond start and goals: samples of a joint without limits


@dataclass(slots=True)
class PathSearch:
    """Searches of one step: `spec` has the planner's settings, `left` samples remain, `rng` draws them."""

    spec: PlannerSpec
    rng: np.random.Generator
    left: int
    failed: NotPlannable | None = None
    """The latest refusal of a search with enough samples, which is repeated when fewer are left."""

    @staticmethod
    def of(spec: PlannerSpec, rng: np.random.Generator) -> PathSearch:
        """For a new step; `rng` itself draws nothing."""
        return PathSearch(spec, rng.spawn(1)[0], STEP * spec.samples)

    def path(
        self,
        robot: RobotModel,
        state: PlanningState,
        query: CollisionQuery,
        names: Sequence[str],
        goals: Array,
        grip: Grip | None,
        margin: Margin | None = None,
        keeps: str = "",
    ) -> Array:
        """A short free path (k, m) of the joints `names` from `state` to one of the `goals` (j, m), also while the
        hand moves as in `grip`. It keeps constraints whose `margin` at positions (i, n) of all joints is not negative;
        `keeps` names them.

        Raises:
            NotPlannable: there is none; names the narrowest place that was found.
        """
        if self.failed is not None and self.left <= 0:
            raise self.failed
        query.kinematics.work.doing(PATH_SEARCH)
        columns = list(robot.indices(tuple(names)))
        space = FreeSpace(robot, query, names, _hands(robot, state.position, grip))
        start = np.array(state.position[columns])
        lower, upper = position_limits(robot.joint(name) for name in names)
        ends = np.vstack((start, goals))
        problem = PathProblem(
            start=start,
            goals=goals,
            # A start outside the limits is reported when the trajectory is verified.
            lower=np.where(np.isfinite(lower), np.minimum(lower, ends.min(axis=0)), ends.min(axis=0) - _UNLIMITED),
            upper=np.where(np.isfinite(upper), np.maximum(upper, ends.max(axis=0)), ends.max(axis=0) + _UNLIMITED),
            valid=space.valid,
            edge=space.edge,
        )
        if margin is not None:
            problem = kept_problem(problem, partial(_at, margin, state.position, columns, query.kinematics.work))
        samples = max(1, -(-self.left // STEP))
        member = PATH_PLANNERS[self.spec.type]
        settings = member.spec.model_validate({**self.spec.model_dump(), "samples": samples})
        if margin is not None and isinstance(settings, RrtConnectSpec):
            settings = settings.model_copy(update={"range": min(settings.range or LONGEST, LONGEST)})
        found = member.make(settings).plan(problem, self.rng)
        if isinstance(found, PathFailure):
            self.left -= max(1, found.samples)
            if self.failed is None or samples >= TELLING * self.spec.samples:
                with query.kinematics.work.beyond(NARROWEST):
                    self.failed = self._refusal(space, found, keeps, state)
            raise self.failed
        return shortened(found, problem, self.rng, attempts=self.spec.shortcuts)

    def _refusal(self, space: FreeSpace, failure: PathFailure, keeps: str, state: PlanningState) -> NotPlannable:
        texts = [f"no path around obstacles{keeps and f' keeps {keeps}'}: {failure.why}"]
        hit = space.first_hit(failure.near_start, failure.near_goal)
        if hit is not None:
            apart = "overlap by" if hit.distance < 0.0 else "are only"
            texts.append(
                f"at the narrowest place found, '{hit.a}' and '{hit.b}' {apart} {hit.amount}"
                + ("" if hit.distance < 0.0 else " apart")
            )
        commonest = space.commonest()
        if commonest is not None:
            (a, b), share = commonest
            texts.append(f"'{a}' and '{b}' block {100.0 * share:.0f} % of the examined motions")
        held = "" if state.carried is None else state.carried.body
        parts = () if hit is None else (hit.a, hit.b)
        bodies = [name for name in parts if name != held and not name.startswith("robot/")]
        away = f"move '{bodies[0]}' away, or " if bodies else ""
        hint = f"{away}first `move` to a pose nearer to the goal, or raise `planner: {{samples: ...}}`"
        if keeps:
            hint = f"make the constraint wider, or {hint}"
        return NotPlannable("; ".join(texts), hint=hint, reason="in_the_way")


def _at(margin: Margin, start: Array, columns: list[int], work: Work, q: Array) -> Array:
    """The margin with the joints of `columns` at `q` (k, m), the others as in `start` (n)."""
    work.add(MARGINS)
    whole = np.tile(start, (len(q), 1))
    whole[:, columns] = q
    return margin(whole)


def _hands(robot: RobotModel, position: Array, grip: Grip | None) -> list[Array]:
    """(n) each: the positions of all joints with the hand at the start, in the middle and at the end of its motion."""
    if grip is None:
        return [position]
    columns = robot.indices(grip.joints)
    found = []
    for share in (1.0, 0.0, 0.5):
        q = np.array(position)
        q[columns] += share * (grip.target - q[columns])
        found.append(np.asarray(with_mimics(robot, q)))
    still = bool(np.max(np.abs(grip.target - position[columns])) < 1e-6)
    return found[:1] if still else found
