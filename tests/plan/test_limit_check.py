from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.limit_check import verify
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.trajectory import JointTrajectory

T = np.arange(1001) * 1e-3


def limits(**changed: float) -> MotionLimits:
    """One joint whose sine q = sin(2 t) touches each limit: |q| 1, |q'| 2, |q''| 4, |q'''| 8."""
    touched = {"lower": -1.0, "upper": 1.0, "velocity": 2.0, "acceleration": 4.0, "jerk": 8.0} | changed
    return MotionLimits(("j",), soft=frozenset(), **{name: np.array([value]) for name, value in touched.items()})


def sine(*, velocities: bool = True, accelerations: bool = True) -> JointTrajectory:
    def column(values: Array) -> Array:
        return np.asarray(values[:, None])

    return JointTrajectory.of_arrays(
        ("j",),
        T,
        column(np.sin(2 * T)),
        column(2 * np.cos(2 * T)) if velocities else None,
        column(-4 * np.sin(2 * T)) if accelerations else None,
    )


def test_a_motion_that_touches_every_limit_passes() -> None:
    verify(sine(), limits())


@pytest.mark.parametrize(
    ("limit", "value", "message"),
    [
        ("upper", 0.9, r"joint 'j' goes to 1\.0000 rad at t = 0\.785 s, beyond its upper limit 0\.9000 rad"),
        ("lower", 0.1, r"joint 'j' begins at 0\.0000 rad, beyond its lower limit 0\.1000 rad"),
        ("velocity", 1.98, r"velocity 2 rad/s at t = 0\.000 s; its limit is 1\.98 rad/s"),
        ("acceleration", 3.97, r"acceleration 4 rad/s2 at t = 0\.785 s; its limit is 3\.97 rad/s2"),
        ("jerk", 7.9, r"jerk 8 rad/s3 at t = 0\.000 s; its limit is 7\.9 rad/s3"),
    ],
)
def test_one_percent_beyond_a_limit_is_refused_with_joint_value_limit_and_time(
    limit: str, value: float, message: str
) -> None:
    with pytest.raises(NotPlannable, match=message) as refused:
        verify(sine(), limits(**{limit: value}))
    assert refused.value.hint is None, "nobody wrote these points"


def test_a_joint_that_slides_is_told_in_metres() -> None:
    sliding = frozenset({"j"})
    with pytest.raises(NotPlannable, match=r"velocity 2 m/s at t = 0\.000 s; its limit is 1\.98 m/s$"):
        verify(sine(), dataclasses.replace(limits(velocity=1.98), sliding=sliding))
    with pytest.raises(NotPlannable, match=r"goes to 1\.0000 m at t = 0\.785 s, beyond its upper limit 0\.9000 m$"):
        verify(sine(), dataclasses.replace(limits(upper=0.9), sliding=sliding))


def test_a_soft_limit_is_called_so_and_the_hint_says_where_it_is_stated() -> None:
    at_start = dataclasses.replace(limits(lower=0.1), soft=frozenset({("j", 0)}))
    on_way = dataclasses.replace(limits(upper=0.9), soft=frozenset({("j", 1)}))
    hard = dataclasses.replace(limits(upper=0.9), soft=frozenset({("j", 0)}))
    told = []
    for each in (at_start, on_way, hard):
        with pytest.raises(NotPlannable) as refused:
            verify(sine(), each)
        told.append((refused.value.cause, refused.value.hint))
    within, stated = "change ", "`k_position` in the robot file; plans stay within soft limits"
    assert told == [
        (
            "joint 'j' begins at 0.0000 rad, beyond its soft lower limit 0.1000 rad",
            f"{within}that pose, or the task's `start`, or `soft_lower` or {stated}",
        ),
        (
            "joint 'j' goes to 1.0000 rad at t = 0.785 s, beyond its soft upper limit 0.9000 rad",
            f"{within}the goal, or `soft_upper` or {stated}",
        ),
        ("joint 'j' goes to 1.0000 rad at t = 0.785 s, beyond its upper limit 0.9000 rad", None),
    ]


def test_half_a_percent_is_forgiven() -> None:
    verify(sine(), limits(velocity=2 / 1.004, acceleration=4 / 1.004, jerk=8 / 1.004))


def test_positions_alone_betray_their_velocity() -> None:
    with pytest.raises(NotPlannable, match="velocity 2 "):
        verify(sine(velocities=False, accelerations=False), limits(velocity=1.9))


def test_velocities_alone_betray_their_acceleration() -> None:
    with pytest.raises(NotPlannable, match="acceleration 4 "):
        verify(sine(accelerations=False), limits(acceleration=3.9))


def test_points_that_understate_what_the_positions_do_are_refused() -> None:
    honest = sine()
    assert honest.velocities is not None
    lying = JointTrajectory.of_arrays(("j",), T, honest.positions, 0.5 * honest.velocities, honest.accelerations)
    with pytest.raises(NotPlannable, match="velocity 2 "):
        verify(lying, limits(velocity=1.5))
