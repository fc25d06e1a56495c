"""When damping is stiff: the share of velocities that a step takes away, against the eigenvalues of that step."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.model.damping import STIFF, damping_share, implicit_damping


@pytest.mark.parametrize("seed", range(20))
def test_no_step_takes_away_more_than_the_share_says(seed: int) -> None:
    """Explicit Euler, v' = v - s M^-1 B v: its eigenvalues are 1 - share; of one joint the share is that, s b / m."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 8))
    root = rng.normal(size=(n, n))
    mass, damping, step = root @ root.T + 0.1 * np.eye(n), rng.uniform(0.0, 30.0, n), 1e-3
    taken = np.linalg.eigvals(step * np.linalg.solve(mass, np.diag(damping)))
    assert taken.real.max() <= damping_share(mass, damping, step).max() * (1.0 + 1e-9)
    alone = damping_share(np.diag(np.diag(mass)), damping, step)
    np.testing.assert_allclose(alone, step * damping / np.diag(mass))


def test_two_joints_that_damp_each_other_share_what_neither_takes_alone() -> None:
    """M^-1 = [[1, 0.9], [0.9, 1]]: the mode in which both move takes 1.9 times what either does."""
    mass, damping = np.linalg.inv([[1.0, 0.9], [0.9, 1.0]]), np.full(2, 400.0)
    np.testing.assert_allclose(damping_share(mass, damping, 1e-3), 0.76)
    np.testing.assert_allclose(implicit_damping(mass, damping, 1e-3), 0.4)
    assert not implicit_damping(np.eye(2), damping, 1e-3).any()


def test_only_stiff_joints_are_damped_implicitly() -> None:
    mass, step = np.diag([1.0, 1.0, 1.0]), 0.01
    damping = np.array([0.0, 0.99, 1.01]) * STIFF / step
    np.testing.assert_allclose(implicit_damping(mass, damping, step), [0.0, 0.0, 1.01 * STIFF])
