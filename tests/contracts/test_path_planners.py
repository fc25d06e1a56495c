"""What every path planner promises, on problems in the plane whose answer is known: walls with and without a gap."""

from __future__ import annotations

import importlib.util
from itertools import pairwise

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.plan.path_planner import PathFailure, PathPlannerMember, PathProblem
from manipcli.plan.path_planners import PATH_PLANNERS
from manipcli.plan.path_planners.rrt_connect import RrtConnectSpec
from manipcli.spec.planner import PlannerSpec

Box = tuple[float, float, float, float]  # x from, x to, y from, y to


def _usable(member: PathPlannerMember[PlannerSpec]) -> object:
    absent = member.name == "ompl" and importlib.util.find_spec("ompl") is None
    return pytest.param(member, id=member.name, marks=pytest.mark.skipif(absent, reason="needs the extra 'ompl'"))


every_planner = pytest.mark.parametrize("member", [_usable(member) for member in PATH_PLANNERS])


def crosses(a: Array, b: Array, box: Box) -> bool:
    """Whether the line segment from a to b meets the box: the slab method, exact."""
    first, last = 0.0, 1.0
    for k in range(2):
        low, high = box[2 * k], box[2 * k + 1]
        d = b[k] - a[k]
        if abs(d) < 1e-15:
            if not low <= a[k] <= high:
                return False
            continue
        enter, leave = sorted(((low - a[k]) / d, (high - a[k]) / d))
        first, last = max(first, enter), min(last, leave)
    return bool(first <= last)


def plane(boxes: list[Box], start: tuple[float, float], *goals: tuple[float, float]) -> PathProblem:
    """A point among boxes in [-1, 1] x [-1, 1]."""
    return PathProblem(
        start=np.array(start),
        goals=np.array(goals),
        lower=np.array([-1.0, -1.0]),
        upper=np.array([1.0, 1.0]),
        valid=lambda q: not any(crosses(q, q, box) for box in boxes),
        edge=lambda a, b: not any(crosses(a, b, box) for box in boxes),
    )


def found(member: PathPlannerMember[PlannerSpec], problem: PathProblem, *, samples: int = 3000, seed: int = 0) -> Array:
    path = member.make(member.spec(type=member.name, samples=samples)).plan(problem, np.random.default_rng(seed))
    assert not isinstance(path, PathFailure)
    return path


def assert_solves(path: Array, problem: PathProblem, boxes: list[Box]) -> None:
    assert np.array_equal(path[0], problem.start)
    assert any(np.allclose(path[-1], goal, atol=1e-12) for goal in problem.goals)
    assert ((path >= problem.lower) & (path <= problem.upper)).all()
    assert not any(crosses(a, b, box) for a, b in pairwise(path) for box in boxes)


WALL: list[Box] = [(-0.01, 0.01, -1.0, 0.8)]  # a gap above y = 0.8


@every_planner
def test_a_free_line_is_found(member: PathPlannerMember[PlannerSpec]) -> None:
    problem = plane([], (-0.5, 0.0), (0.5, 0.2))
    assert_solves(found(member, problem), problem, [])


@every_planner
@pytest.mark.parametrize("seed", range(5))
def test_a_path_leads_around_a_wall(member: PathPlannerMember[PlannerSpec], seed: int) -> None:
    problem = plane(WALL, (-0.5, -0.5), (0.5, -0.5))
    path = found(member, problem, seed=seed)
    assert_solves(path, problem, WALL)
    assert path[:, 1].max() > 0.8  # the only gap


@every_planner
def test_a_maze_is_solved(member: PathPlannerMember[PlannerSpec]) -> None:
    maze: list[Box] = [(-0.52, -0.5, -1.0, 0.7), (-0.01, 0.01, -0.7, 1.0), (0.5, 0.52, -1.0, 0.7)]
    problem = plane(maze, (-0.9, -0.9), (0.9, -0.9))
    path = found(member, problem, samples=20000)
    assert_solves(path, problem, maze)
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    corners = [  # of the shortest path
        (-0.9, -0.9),
        (-0.52, 0.7),
        (-0.5, 0.7),
        (-0.01, -0.7),
        (0.01, -0.7),
        (0.5, 0.7),
        (0.52, 0.7),
        (0.9, -0.9),
    ]
    assert length >= np.linalg.norm(np.diff(corners, axis=0), axis=1).sum() - 1e-9  # no path is shorter than this one


@every_planner
def test_the_reachable_goal_of_several_is_found(member: PathPlannerMember[PlannerSpec]) -> None:
    cell: list[Box] = [(0.2, 0.8, -0.2, -0.1), (0.2, 0.8, 0.1, 0.2), (0.2, 0.3, -0.2, 0.2), (0.7, 0.8, -0.2, 0.2)]
    problem = plane(cell, (-0.5, 0.0), (0.5, 0.0), (-0.5, 0.6))  # the first goal is walled in
    path = found(member, problem)
    assert_solves(path, problem, cell)
    assert np.allclose(path[-1], (-0.5, 0.6))


@every_planner
def test_no_path_through_a_closed_wall(member: PathPlannerMember[PlannerSpec]) -> None:
    problem = plane([(-0.01, 0.01, -1.0, 1.0)], (-0.5, 0.0), (0.5, 0.0))
    failure = member.make(member.spec(type=member.name, samples=300)).plan(problem, np.random.default_rng(0))
    assert isinstance(failure, PathFailure)
    assert failure.samples >= 300
    assert failure.near_start[0] < 0.0 < failure.near_goal[0]


def test_the_closest_approach_of_the_two_trees_is_at_the_narrowest_place() -> None:
    """A wall, thick at its ends and thin in its middle: the trees come nearest there."""
    boxes: list[Box] = [(-0.4, 0.4, -1.0, -0.2), (-0.02, 0.02, -0.2, 0.2), (-0.4, 0.4, 0.2, 1.0)]
    spec = RrtConnectSpec(samples=2000)
    failure = (
        PATH_PLANNERS["rrt_connect"].make(spec).plan(plane(boxes, (-0.9, -0.9), (0.9, -0.9)), np.random.default_rng(1))
    )
    assert isinstance(failure, PathFailure)
    assert abs(failure.near_start[1]) < 0.2
    assert abs(failure.near_goal[1]) < 0.2
    assert failure.near_goal[0] - failure.near_start[0] < 0.1  # the wall is 4 cm thick there


def test_rrt_connect_gives_the_same_path_for_the_same_seed() -> None:
    problem = plane(WALL, (-0.5, -0.5), (0.5, -0.5))
    paths = [found(PATH_PLANNERS["rrt_connect"], problem, seed=7) for _ in range(2)]
    assert paths[0].tobytes() == paths[1].tobytes()


def test_rrt_connect_keeps_its_longest_step() -> None:
    problem = plane(WALL, (-0.5, -0.5), (0.5, -0.5))
    path = PATH_PLANNERS["rrt_connect"].make(RrtConnectSpec(range=0.1)).plan(problem, np.random.default_rng(0))
    assert isinstance(path, np.ndarray)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= 0.1 + 1e-12


def test_rrt_connect_projects_what_it_adds() -> None:
    """Configurations on the circle of radius 0.7 only: a path from one side to the other stays on it."""

    def project(q: Array) -> Array | None:
        length = float(np.linalg.norm(q))
        return None if length < 1e-3 else 0.7 / length * q

    free = plane([(0.4, 1.0, -0.05, 0.05)], (0.0, 0.7), (0.0, -0.7))
    problem = PathProblem(free.start, free.goals, free.lower, free.upper, free.valid, free.edge, project)
    path = PATH_PLANNERS["rrt_connect"].make(RrtConnectSpec(range=0.1)).plan(problem, np.random.default_rng(3))
    assert isinstance(path, np.ndarray)
    assert np.allclose(np.linalg.norm(path, axis=1), 0.7)
    assert path[:, 0].min() < -0.6  # around the left side, since the right side is blocked
