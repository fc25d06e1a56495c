"""What interpolation between the kept states shows is what the run was, at every time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from manipcli.replay.level_of_detail import (
    POSITION,
    ROTATION,
    interpolated,
    interpolated_quats,
    needed_rows,
    value_errors,
)

TIMES = np.arange(500) * 0.02


@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 0.3))
def test_every_value_is_within_the_bound(seed: int, share: float) -> None:
    """Oracle: numpy's interpolation of each column between the kept rows."""
    draw = np.random.default_rng(seed)
    values = np.cumsum(draw.normal(size=(300, 3)) * (draw.random((300, 1)) < 0.1), axis=0)
    times = np.cumsum(draw.uniform(0.001, 0.05, 300))
    kept = needed_rows(300, value_errors(times, values, share))
    for column in values.T:
        shown = np.interp(times, times[kept], column[kept])
        assert np.abs(shown - column).max() <= share * np.ptp(column) + 1e-9


def test_rest_needs_few_rows_and_a_straight_line_too() -> None:
    values = np.interp(TIMES, [0.0, 4.0, 5.0, 9.98], [0.0, 0.0, 1.0, 1.0])[:, None]
    kept = needed_rows(len(TIMES), value_errors(TIMES, values, 1e-3))
    assert {200, 250} <= set(kept.tolist())  # the corners
    assert len(kept) <= len(TIMES) / 64 + 6


def test_what_is_unknown_stays_unknown() -> None:
    """Whatever is known in only one of both would be a value that the run did not have, or one that is lost."""
    values = np.sin(TIMES)[:, None].repeat(2, axis=1)
    values[100:200, 0] = np.nan
    kept = needed_rows(len(TIMES), value_errors(TIMES, values, 0.01))
    shown = interpolated(TIMES, values, kept, np.arange(len(TIMES)))
    np.testing.assert_array_equal(np.isnan(shown), np.isnan(values))


def test_rows_that_must_be_kept_are_kept() -> None:
    still = np.zeros((500, 1))
    assert {17, 18} <= set(needed_rows(500, value_errors(TIMES, still, 0.1), always=[17, 18]).tolist())
    assert needed_rows(1, value_errors(TIMES[:1], still[:1], 0.1)).tolist() == [0]


def test_quaternions_are_interpolated_along_the_shorter_arc() -> None:
    """Oracle: scipy's slerp, which for small angles a normalized linear interpolation equals to third order."""
    ends = Rotation.from_rotvec([[0.1, 0.2, 0.3], [0.15, 0.1, 0.35]])
    quats = ends.as_quat()
    for sign in (1.0, -1.0):
        table = np.array([quats[0], quats[0], sign * quats[1]])[:, None]
        (shown,) = interpolated_quats(np.array([0.0, 0.3, 1.0]), table, np.array([0, 2]), np.array([1]))
        wanted = Slerp([0.0, 1.0], ends)(0.3)
        assert (Rotation.from_quat(shown[0]) * wanted.inv()).magnitude() < 1e-4
    assert pytest.approx(0.0005) == POSITION and np.degrees(ROTATION) == pytest.approx(0.2)
