"""Rounded corners: within the stated deviation, smooth, and unchanged away from the corners."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.geometry import Array
from manipcli.plan.path_smoothing import rounded


def distance(q: Array, path: Array) -> float:
    """From a point to a polyline."""
    found = []
    for a, b in pairwise(path):
        share = float(np.clip((q - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0))
        found.append(float(np.linalg.norm(q - a - share * (b - a))))
    return min(found)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), n=st.integers(1, 7), m=st.integers(2, 8), deviation=st.floats(1e-3, 0.5))
def test_no_point_is_further_off_than_the_deviation(seed: int, n: int, m: int, deviation: float) -> None:
    path = np.random.default_rng(seed).uniform(-1.0, 1.0, (m, n))
    points = rounded(path, deviation)
    assert np.array_equal(points[[0, -1]], path[[0, -1]])
    assert max(distance(q, path) for q in points) <= deviation + 1e-9


def test_a_corner_of_long_legs_uses_the_whole_deviation() -> None:
    path = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 5.0]])
    corner = min(float(np.linalg.norm(q - path[1])) for q in rounded(path, 0.2))
    assert corner == pytest.approx(0.2, rel=1e-6)


def test_a_rounded_corner_has_no_kink() -> None:
    """The direction turns by 90 deg in small steps, and evenly: no curvature where the curve meets its legs."""
    points = rounded(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), 0.1)
    steps = np.diff(points, axis=0)
    turns = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    assert turns.sum() == pytest.approx(np.pi / 2)
    assert (turns > -1e-12).all()
    assert turns.max() < np.radians(25.0)
    corner = turns[turns > 1e-12]
    assert corner[0] < 0.5 * corner.max()


def test_a_straight_path_stays_straight() -> None:
    points = rounded(np.array([[0.0, 1.0], [2.0, 1.0]]), 0.1)
    assert np.allclose(points[:, 1], 1.0)
    assert (np.diff(points[:, 0]) > 0.0).all()


def test_a_path_that_turns_back_is_rounded_to_its_end() -> None:
    """A reversal: u = w, so that no curve deviates, and the corner is kept."""
    points = rounded(np.array([[0.0], [1.0], [0.2]]), 0.1)
    assert points.max() <= 1.0
    assert points[-1] == pytest.approx(0.2)
