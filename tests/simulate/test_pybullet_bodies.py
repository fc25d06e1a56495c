"""A body of the scene is in the engine what it is in the scene: every wall is there, and so are mass and inertia."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import ManipcliError
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Body
from manipcli.simulate.engines import pybullet_world
from manipcli.simulate.engines.pybullet_world import add_body
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

RADIUS, WALL, HEIGHT, MASS = 0.03, 0.003, 0.1, 0.12


@pytest.fixture
def bullet() -> Iterator[tuple[ModuleType, int]]:
    p = pytest.importorskip("pybullet")
    client = p.connect(p.DIRECT)
    yield p, client
    p.disconnect(physicsClientId=client)


def _cup(segments: int, *, fixed: bool) -> Body:
    cup = {"radius": RADIUS, "height": HEIGHT, "wall": WALL, "segments": segments}
    written = {"cup": cup, "mass": MASS, "pose": {"xyz": [0.2, 0.1, 0.3], "rpy": [0.3, 0.2, 0.1]}, "fixed": fixed}
    fields: dict[str, Any] = {"task": "t", "scene": {"cup": BodySpec.model_validate(written)}, "frames": {}}
    return build_scene(TaskSpec.model_construct(**fields)).body("cup")


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("segments", [12, 15, 16, 24, 64])
def test_a_ray_from_the_axis_meets_every_wall(
    bullet: tuple[ModuleType, int], tmp_path: Path, segments: int, fixed: bool
) -> None:
    p, client = bullet
    cup = _cup(segments, fixed=fixed)
    add_body(p, client, cup, tmp_path)
    p.performCollisionDetection(physicsClientId=client)
    angles = 2.0 * math.pi * np.arange(segments) / segments
    heights = (0.02, 0.08)
    starts = [cup.X_WO.p + cup.X_WO.R @ [0.0, 0.0, z] for _ in angles for z in heights]
    ends = [cup.X_WO.p + cup.X_WO.R @ [0.1 * math.cos(a), 0.1 * math.sin(a), z] for a in angles for z in heights]
    hits = p.rayTestBatch(starts, ends, physicsClientId=client)
    far = [0.1 * hit[2] for hit in hits]
    np.testing.assert_allclose(far, RADIUS - WALL, atol=1e-5)
    (below,) = p.rayTest(starts[0], cup.X_WO.p - cup.X_WO.R @ [0.0, 0.0, 0.1], physicsClientId=client)
    assert 0.12 * below[2] == pytest.approx(0.02 - WALL, abs=1e-5)


@pytest.mark.parametrize("segments", [12, 24])
def test_it_has_its_mass_its_inertia_and_its_place(
    bullet: tuple[ModuleType, int], tmp_path: Path, segments: int
) -> None:
    p, client = bullet
    cup = _cup(segments, fixed=False)
    k = add_body(p, client, cup, tmp_path)
    mass, friction, inertia, *_ = p.getDynamicsInfo(k, -1, physicsClientId=client)
    assert (mass, friction) == (MASS, cup.friction)
    np.testing.assert_allclose(inertia, np.diag(cup.inertia), rtol=1e-12)
    position, quat_xyzw = p.getBasePositionAndOrientation(k, physicsClientId=client)
    X_WI = cup.X_WO @ cup.X_OI
    np.testing.assert_allclose(position, X_WI.p, atol=1e-12)
    assert abs(np.dot(quat_xyzw, X_WI.quat_xyzw)) == pytest.approx(1.0, abs=1e-12)
    p.setTimeStep(1e-3, physicsClientId=client)
    p.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
    for _ in range(100):
        p.stepSimulation(physicsClientId=client)
    fallen = position[2] - p.getBasePositionAndOrientation(k, physicsClientId=client)[0][2]
    assert fallen == pytest.approx(0.5 * 9.81 * 0.1**2, rel=0.02)


def test_a_fixed_body_of_many_shapes_does_not_fall(bullet: tuple[ModuleType, int], tmp_path: Path) -> None:
    p, client = bullet
    cup = _cup(24, fixed=True)
    k = add_body(p, client, cup, tmp_path)
    p.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
    for _ in range(50):
        p.stepSimulation(physicsClientId=client)
    np.testing.assert_allclose(p.getBasePositionAndOrientation(k, physicsClientId=client)[0], (cup.X_WO @ cup.X_OI).p)


def test_both_ways_to_make_a_body_move_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    p = pytest.importorskip("pybullet")

    def falls(most: int) -> np.ndarray:
        monkeypatch.setattr(pybullet_world, "MAX_SHAPES", most)
        client = p.connect(p.DIRECT)
        p.setPhysicsEngineParameter(fixedTimeStep=1e-3, deterministicOverlappingPairs=1, physicsClientId=client)
        p.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        floor = p.createCollisionShape(p.GEOM_BOX, halfExtents=[1.0, 1.0, 0.05], physicsClientId=client)
        p.createMultiBody(0.0, floor, basePosition=[0.0, 0.0, 0.2], physicsClientId=client)
        k = add_body(p, client, _cup(12, fixed=False), tmp_path)
        for _ in range(300):
            p.stepSimulation(physicsClientId=client)
        place = np.concatenate(p.getBasePositionAndOrientation(k, physicsClientId=client))
        p.disconnect(physicsClientId=client)
        return place

    np.testing.assert_allclose(falls(16), falls(1), atol=1e-9)


def test_a_body_that_the_engine_cuts_is_told(
    bullet: tuple[ModuleType, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    p, client = bullet
    monkeypatch.setattr(pybullet_world, "MAX_SHAPES", 100)
    with pytest.raises(ManipcliError, match="different body than 'cup': it has 16 shapes instead of 25"):
        add_body(p, client, _cup(24, fixed=True), tmp_path)
