"""Limits of attachments in closed form, and the surface in front of a tool."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.model.holding import Holding, surface
from manipcli.shapes.primitives import Box
from tests.contracts.test_engines import body

CUP = Holding("suction", 60.0, 2.0, 0.002)


def wrench(*force: float, torque: float = 0.0) -> np.ndarray:
    return np.array([*force, 0.0, torque, 0.0])


@pytest.mark.parametrize("pull", [0.0, 20.0, 50.0])
@pytest.mark.parametrize("mu", [0.2, 1.0])
def test_a_cup_holds_shear_by_friction_with_what_its_pull_leaves(pull: float, mu: float) -> None:
    shear = mu * (60.0 - pull)
    assert CUP.load(wrench(0.6 * shear, 0.8 * shear, -pull), mu).share == pytest.approx(1.0)
    assert CUP.load(wrench(0.0, 1.01 * shear, -pull), mu).share > 1.0


def test_pressing_on_a_cup_adds_to_its_friction() -> None:
    assert CUP.load(wrench(0.0, 0.0, 500.0), 0.5).share == 0.0
    assert CUP.load(wrench(40.0, 0.0, 20.0), 0.5).share == pytest.approx(1.0)  # 0.5 (60 + 20)
    assert CUP.load(wrench(1.0, 0.0, 0.0), 0.0).share == math.inf


def test_torque_breaks_a_cup_and_a_weld() -> None:
    for holding in (CUP, Holding("weld", 60.0, 2.0)):
        assert holding.load(wrench(0.0, 0.0, -30.0, torque=1.9), 0.5).share < 1.0
        broken = holding.load(wrench(0.0, 0.0, -30.0, torque=2.1), 0.5)
        assert broken.share == pytest.approx(1.05) and "torque 2.1 N m, limit 2 N m" in broken.text


def test_a_weld_breaks_by_the_size_of_the_force_or_never() -> None:
    assert Holding("weld", 10.0, 1.0).load(wrench(3.0, 4.0, 12.0), 0.0).share == pytest.approx(1.3)
    assert Holding("weld", math.inf, math.inf).load(wrench(1e6, 0.0, 0.0, torque=1e6), 0.0).share == 0.0


def test_the_gap_is_the_distance_to_the_surface_and_its_direction_counts() -> None:
    block = body("block", Box((0.04, 0.04, 0.04)), (0.5, 0.0, 0.1))
    down = (math.pi, 0.0, 0.0)
    for gap in (-0.003, 0.0015, 0.01):
        seen = surface(block, block.X_WO, Transform.of(xyz=(0.51, 0.0, 0.12 + gap), rpy=down))
        assert seen.gap == pytest.approx(gap, abs=1e-6)
        assert seen.facing == pytest.approx(1.0, abs=1e-3)
        assert bool(CUP.missed(seen, "block")) == (gap > CUP.reach)
    tilted = surface(block, block.X_WO, Transform.of(xyz=(0.5, 0.0, 0.121), rpy=(math.pi - 0.7, 0.0, 0.0)))
    assert "tilted by 40 deg" in CUP.missed(tilted, "block")
    above = surface(block, block.X_WO, Transform.of(xyz=(0.5, 0.0, 0.121)))
    assert "tilted by 180 deg" in CUP.missed(above, "block")


def test_a_tool_exactly_on_a_surface_has_its_direction() -> None:
    block = body("block", Box((0.04, 0.04, 0.04)), (0.5, 0.0, 0.1))
    for depth in (0.0, 1e-5, 2e-5):  # the probe inside, touching and outside
        for rpy, facing in (((math.pi, 0.0, 0.0), 1.0), ((0.0, 0.0, 0.0), -1.0)):
            seen = surface(block, block.X_WO, Transform.of(xyz=(0.5, 0.0, 0.12 + depth - 1e-5), rpy=rpy))
            assert seen.facing == pytest.approx(facing, abs=1e-3)
