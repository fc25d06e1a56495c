"""The error of a pose with a free axis is the least over all rotations about it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manipcli.core.geometry import Transform
from manipcli.plan.pose_error import Open, PoseTolerance, pose_error


@pytest.mark.parametrize("within", [math.pi, 1.0, 0.2])
def test_the_angle_is_the_least_within_the_bounds_of_the_axis(within: float) -> None:
    rng = np.random.default_rng(5)
    turns = np.linspace(-within, within, 4001)
    for _ in range(20):
        R_G, R_T = Rotation.random(2, random_state=rng)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        about = PoseTolerance(1e-4, 1e-3, axis=axis, within=within)
        goal = Transform.of(R=R_G.as_matrix())
        error, free, angle = pose_error(goal, R_T.as_matrix(), np.zeros(3), "nothing", about)
        least = float((Rotation.from_rotvec(turns[:, None] * axis) * R_G * R_T.inv()).magnitude().min())
        assert angle == pytest.approx(least, abs=2e-3)
        assert np.linalg.norm(error[3:]) == pytest.approx(angle)
        if free is not None:
            assert error[3:] @ axis == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("open_", ["spin", "yaw"])
def test_a_rotation_about_the_open_axis_is_no_error(open_: Open) -> None:
    rng = np.random.default_rng(6)
    for R in Rotation.random(20, random_state=rng):
        turn = Rotation.from_euler("z", rng.uniform(-3.1, 3.1))
        rotated = R * turn if open_ == "spin" else turn * R
        _, _, angle = pose_error(Transform.of(R=R.as_matrix()), rotated.as_matrix(), np.zeros(3), open_)
        assert angle == pytest.approx(0.0, abs=1e-9)
