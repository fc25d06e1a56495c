"""python -m benchmarks.paths [--count N] [KIND...]: paths around obstacles, beside OMPL's where it is installed.

Every problem is solved by `rrt_connect` and by OMPL's RRT-Connect with the same predicates for configurations and edges
(`manipcli.plan.free_space`), in turn. Both first paths are timed. Ours is then shortened, rounded and timed as in a
plan, OMPL's is simplified by its `simplifyMax`. The motion at the end is checked by PyBullet's own distance query
between the same convex parts, at configurations at most 2 mrad apart.
"""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np

from benchmarks.parts_in_pybullet import collides
from benchmarks.path_problems import COUNT, KINDS, Problem, problems
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.configuration import position_limits
from manipcli.plan.free_motion import around
from manipcli.plan.free_space import FreeSpace
from manipcli.plan.motion import PlanningState
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path_planner import PathFailure, PathProblem
from manipcli.plan.path_planners.ompl import Ompl, OmplSpec, space
from manipcli.plan.path_planners.rrt_connect import RrtConnect, RrtConnectSpec
from manipcli.plan.path_search import PathSearch
from manipcli.plan.path_shortening import length_of, shortened
from manipcli.plan.planner import CLEARANCE

clock = time.process_time  # one thread computes; other processes do not count
HEAD = (
    "kind",
    "straight line in collision",
    "solved",
    "in collision",
    "first path",
    "OMPL",
    "ratio",
    "shortened in",
    "OMPL's simplification",
    "motion in all",
    "length to OMPL's",
)
SHORTCUTS = RrtConnectSpec().shortcuts


@dataclass
class Tally:
    """Of one kind: times [s] and lengths [rad] per problem, and what was solved."""

    own: list[float] = field(default_factory=list)
    ompl: list[float] = field(default_factory=list)
    shortening: list[float] = field(default_factory=list)
    simplifying: list[float] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    motions: list[float] = field(default_factory=list)
    obstructed: int = 0
    solved: int = 0
    hits: int = 0
    tried: int = 0


def measure(problem: Problem, tally: Tally, ompl: tuple[ModuleType, ModuleType] | None, rounds: int) -> None:
    """Solves one problem with both planners, `rounds` times in turn, and plans its motion once."""
    tally.tried += 1
    planner = problem.planner
    names, columns = planner.solver.joints, list(planner.solver.columns)
    query = planner.checker.at(margin=CLEARANCE)
    straight = np.linspace(problem.start, problem.goal, 2)
    tally.obstructed += collides(planner, query.pairs, straight) > 0
    task = _problem(problem, FreeSpace(planner.robot, query, names, [problem.start]))
    task.edge(task.start, task.start + 0.3)  # what is made at the first edge belongs to no planner
    for seed in range(rounds):
        rng = np.random.default_rng(seed)
        began = clock()
        found = RrtConnect(RrtConnectSpec()).plan(task, rng)
        tally.own.append(clock() - began)
        own = None
        if not isinstance(found, PathFailure):
            began = clock()
            own = shortened(found, task, rng, attempts=SHORTCUTS)
            tally.shortening.append(clock() - began)
        if ompl is not None:
            began = clock()
            found = Ompl(OmplSpec()).plan(task, rng)
            tally.ompl.append(clock() - began)
            if seed == 0 and own is not None and not isinstance(found, PathFailure):
                began = clock()
                tally.ratios.append(length_of(own) / length_of(_simplified(*ompl, task, found)))
                tally.simplifying.append(clock() - began)
    state = PlanningState(problem.start, ())
    limits = MotionLimits.of(planner.robot, names)
    search = PathSearch.of(RrtConnectSpec(), np.random.default_rng(problem.number))
    began = clock()
    try:
        motion = around(planner, search, state, query, problem.goal[columns][None], limits, None, "move")
    except NotPlannable as refusal:
        print(f"{problem.kind} {problem.number}: {refusal}")
        return
    tally.motions.append(clock() - began)
    tally.solved += 1
    whole = np.tile(problem.start, (len(motion.positions), 1))
    whole[:, columns] = motion.positions
    tally.hits += collides(planner, query.pairs, whole) > 0


def _problem(problem: Problem, free: FreeSpace) -> PathProblem:
    solver = problem.planner.solver
    columns = list(solver.columns)
    lower, upper = position_limits(problem.planner.robot.joint(name) for name in solver.joints)
    return PathProblem(problem.start[columns], problem.goal[columns][None], lower, upper, free.valid, free.edge)


def _simplified(base: ModuleType, geometric: ModuleType, task: PathProblem, path: Array) -> Array:
    """OMPL's simplification of a path (m, n)."""
    si, _ = space(base, task)
    found = geometric.PathGeometric(si)
    for q in path:
        state = si.allocState()
        for k, value in enumerate(q.tolist()):
            state[k] = value
        found.append(state)
    geometric.PathSimplifier(si).simplifyMax(found)
    return np.array([[state[k] for k in range(path.shape[1])] for state in found.getStates()])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paths", description=__doc__)
    parser.add_argument("kinds", nargs="*", default=list(KINDS), help="of problems (default: all)")
    parser.add_argument("--count", type=int, default=COUNT, help=f"problems of each kind (default {COUNT})")
    parser.add_argument("--rounds", type=int, default=3, help="first paths of each problem (default 3)")
    options = parser.parse_args()
    try:
        from ompl import base, geometric, util

        util.setLogLevel(util.LOG_NONE)
        ompl = base, geometric
    except ImportError:
        ompl = None
        print("OMPL is not installed: `pip install ompl`")
    print("| " + " | ".join(HEAD) + " |")
    print("|---" * len(HEAD) + "|")
    for kind in options.kinds:
        tally = Tally()
        for problem in problems(kind, options.count):
            measure(problem, tally, ompl, options.rounds)
        own, other = 1e3 * statistics.median(tally.own), 1e3 * statistics.median(tally.ompl or [np.nan])
        cells = (
            kind,
            str(tally.obstructed),
            f"{tally.solved} of {tally.tried}",
            str(tally.hits),
            f"{own:.1f} ms",
            f"{other:.1f} ms",
            f"{own / other:.2f}",
            f"{1e3 * statistics.median(tally.shortening or [np.nan]):.0f} ms",
            f"{1e3 * statistics.median(tally.simplifying or [np.nan]):.0f} ms",
            f"{1e3 * statistics.median(tally.motions or [np.nan]):.0f} ms",
            f"{statistics.mean(tally.ratios or [np.nan]):.3f}",
        )
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
