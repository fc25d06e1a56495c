"""A motion that would take for ever is refused before it is sampled, with the joint and the limit to blame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import joint_path
from manipcli.plan.rest_to_rest import rest_to_rest
from manipcli.plan.retimer import retime
from manipcli.plan.trajectory_sampling import LONGEST

JOINTS = ("a", "b", "c")
CURVED = np.array([[0.0, 0.0, 0.0], [0.5, -0.4, 0.3], [0.2, 0.6, -0.2], [1.0, 0.3, 0.4]])


def limits(**of_b: float) -> MotionLimits:
    """Of three joints; those of the second as stated."""
    usual = {"velocity": 2.0, "acceleration": 10.0, "jerk": 100.0}
    arrays = [np.array([value, of_b.get(word, value), value]) for word, value in usual.items()]
    return MotionLimits(JOINTS, np.full(3, -9.0), np.full(3, 9.0), *arrays)


@pytest.mark.parametrize("points", [CURVED[[0, -1]], CURVED])
@pytest.mark.parametrize("word", ["velocity", "acceleration", "jerk"])
@pytest.mark.parametrize("value", [1e-9, 1e-300])
def test_the_joint_that_makes_it_endless_is_named(points: Any, word: str, value: float) -> None:
    with pytest.raises(NotPlannable, match=f"the motion takes more than 600 s with the {word} limit of joint 'b'"):
        retime(joint_path(points), limits(**{word: value}), period=1e-3)


def test_what_takes_a_little_less_is_planned() -> None:
    """0.3 rad at v take 0.3 / v, and less than a second more for the ramps."""
    slow = limits(velocity=0.3 / (LONGEST - 2.0))
    motion = rest_to_rest(CURVED[0], CURVED[-1], slow, period=0.1)
    assert LONGEST - 2.0 < motion.duration < LONGEST
    with pytest.raises(NotPlannable, match="velocity limit of joint 'b'"):
        rest_to_rest(CURVED[0], CURVED[-1], limits(velocity=0.3 / (LONGEST + 2.0)), period=0.1)


def test_written_trajectories_and_slow_hands_are_no_longer(
    bench: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    arm = bench()
    spec = {"joint_names": ["joint_1"], "points": [{"positions": [0.5], "time_from_start": LONGEST + 1.0}]}
    assert "the trajectory takes 601 s" in arm.refused("follow", spec).cause
    monkeypatch.setattr(arm.planner, "gripper_speed", 1e-9)
    assert (
        "the hand takes more than 600 s at its controller's speed of 1e-09 rad/s"
        in arm.refused("move", {"to": "wrap"}).cause
    )
