"""The ground of pictures: where its lines are, and from where it is seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import frozen
from manipcli.render.drawing import draw
from manipcli.render.placing import Placing
from manipcli.replay.camera import Camera
from manipcli.replay.ground import see_ground
from manipcli.replay.renderer import Renderer, sky
from manipcli.scene.scene import Scene

SIZE = (240, 180)
EMPTY = Scene(bodies=(), frames=(), gravity=frozen([0.0, 0.0, -9.8]))


@pytest.mark.parametrize("height", [0.0, -0.3])
def test_lines_are_at_multiples_of_a_decimetre(height: float) -> None:
    """Seen from straight above with x up and -y to the right; oracle: similar triangles."""
    away = 1.0
    camera = Camera(eye=(0.05, 0.05, height + away), target=(0.05, 0.05, height), field=40.0)
    ground = see_ground(height, camera, SIZE)
    assert ground is not None
    np.testing.assert_allclose(ground.depth, away)
    focal = SIZE[1] / 2.0 / math.tan(math.radians(20.0))
    row = ground.colour[SIZE[1] // 2, :, 0]
    y = 0.05 - (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2.0) * away / focal
    near = np.abs(y / 0.1 - np.round(y / 0.1)) * 0.1 < 0.5 * away / focal
    far = np.abs(y / 0.1 - np.round(y / 0.1)) * 0.1 > 3.0 * away / focal
    assert near.sum() >= 7
    assert row[near].max() < row[far].min()
    assert np.ptp(row[far]) < 1e-3
    whole = np.abs(y) < 0.5 * away / focal
    assert row[whole].max() < row[near & ~whole].min()  # a whole metre is darker


def test_a_distant_grid_has_no_pattern_and_fades_into_the_sky() -> None:
    camera = Camera(eye=(1.0, 0.0, 0.4), target=(0.0, 0.0, 0.3), field=40.0)
    image = Renderer(draw(None, EMPTY), size=SIZE, ground=0.0).picture(Placing(None, EMPTY).start(), camera).astype(int)
    horizon = round(SIZE[1] / 2.0 - SIZE[1] / 2.0 / math.tan(math.radians(20.0)) * 0.1)
    assert np.abs(image[horizon - 2 : horizon + 3] - sky(SIZE[1])[horizon - 2 : horizon + 3]).max() <= 2
    assert np.ptp(image[horizon + 4], axis=0).max() <= 3
    assert np.abs(image[-1] - sky(SIZE[1])[-1]).max() > 20


def test_there_is_none_from_below() -> None:
    poses = Placing(None, EMPTY).start()
    camera = Camera(eye=(1.0, 0.0, -0.4), target=(0.0, 0.0, 0.3), field=40.0)
    image = Renderer(draw(None, EMPTY), size=SIZE, ground=0.0).picture(poses, camera)
    assert np.abs(image.astype(int) - sky(SIZE[1])).max() <= 1
