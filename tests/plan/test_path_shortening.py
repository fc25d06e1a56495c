"""Shortened paths: shorter, free, with the same ends, and near the shortest one where that is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.plan.path_planner import PathProblem
from manipcli.plan.path_shortening import length_of, shortened


def clear_of_disc(a: Array, b: Array) -> bool:
    """Whether a line segment in the plane stays outside the unit disc; exact."""
    along = b - a
    share = float(np.clip(-(a @ along) / max(along @ along, 1e-300), 0.0, 1.0))
    return float(np.linalg.norm(a + share * along)) >= 1.0


PROBLEM = PathProblem(
    start=np.array([-2.0, 0.0]),
    goals=np.array([[2.0, 0.0]]),
    lower=np.array([-4.0, -4.0]),
    upper=np.array([4.0, 4.0]),
    valid=lambda q: clear_of_disc(q, q),
    edge=clear_of_disc,
)
SHORTEST = 2.0 * np.sqrt(3.0) + np.pi / 3.0  # two tangents of length sqrt(4 - 1), and the arc between them
DETOUR = np.array([[-2.0, 0.0], [-3.0, 1.0], [-2.0, 3.0], [0.0, 2.0], [0.5, 3.5], [2.0, 3.0], [3.0, 0.5], [2.0, 0.0]])


@pytest.mark.parametrize("seed", range(6))
def test_a_path_around_a_disc_becomes_nearly_the_shortest(seed: int) -> None:
    path = shortened(DETOUR, PROBLEM, np.random.default_rng(seed), attempts=200)
    assert np.array_equal(path[[0, -1]], DETOUR[[0, -1]])
    assert all(clear_of_disc(a, b) for a, b in pairwise(path))
    assert SHORTEST <= length_of(path) <= 1.05 * SHORTEST


def test_a_free_line_remains() -> None:
    above = DETOUR[1:] + np.array([0.0, 2.0])
    path = shortened(above, PROBLEM, np.random.default_rng(0), attempts=200)
    assert np.array_equal(path, above[[0, -1]])


def test_the_same_seed_gives_the_same_path() -> None:
    first, second = (shortened(DETOUR, PROBLEM, np.random.default_rng(3), attempts=50) for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_without_attempts_only_needless_points_go() -> None:
    path = shortened(DETOUR, PROBLEM, np.random.default_rng(0), attempts=0)
    assert {tuple(q) for q in path.tolist()} <= {tuple(q) for q in DETOUR.tolist()}
    assert all(clear_of_disc(a, b) for a, b in pairwise(path))
