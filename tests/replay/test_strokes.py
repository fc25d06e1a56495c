"""Lines and arrows over pictures: where they are, how wide, and what hides them."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.replay.camera import Camera
from manipcli.replay.strokes import BEHIND, arrow, stroke

RED = (200, 0, 0)
SIZE = (120, 90)


def white() -> np.ndarray:
    return np.full((SIZE[1], SIZE[0], 3), 255, dtype=np.uint8)


@pytest.mark.parametrize("width", [1.5, 4.0])
def test_a_line_covers_its_length_times_its_width(width: float) -> None:
    image = white()
    stroke(image, np.array([[20.0, 30.0], [80.0, 60.0], [110.0, 10.0]]), RED, width=width)
    covered = (255.0 - image[..., 1]).sum() / 255.0
    length = np.hypot(60.0, 30.0) + np.hypot(30.0, 50.0)
    assert covered == pytest.approx(length * width, rel=0.08, abs=width**2)
    for share in (0.1, 0.5, 0.9):
        x, y = 20.0 + 60.0 * share, 30.0 + 30.0 * share
        assert image[int(y), int(x), 1] < 90


def test_a_line_behind_something_is_paler() -> None:
    image, wall = white(), np.full((SIZE[1], SIZE[0]), np.inf)
    wall[:, 60:] = 1.0
    stroke(image, np.array([[10.0, 40.5], [110.0, 40.5]]), RED, width=3.0, depth=np.array([2.0, 2.0]), hidden_by=wall)
    assert image[40, 30, 1] == 0
    assert image[40, 90, 1] == pytest.approx(255 * (1.0 - BEHIND), abs=1)


def test_an_arrow_ends_at_its_point_and_is_widest_behind_it() -> None:
    camera = Camera(eye=(2.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), field=40.0)
    image = white()
    start, end = np.array([0.0, -0.3, -0.1]), np.array([0.0, 0.3, -0.1])
    arrow(image, camera, start, end, RED, width=2.0)
    (left, right), rows, _ = camera.project(np.stack([start, end]), SIZE)
    columns = np.flatnonzero((image[..., 1] < 200).any(axis=0))
    assert columns[0] == pytest.approx(left, abs=1.5)
    assert columns[-1] == pytest.approx(right, abs=2.0)
    height = (image[..., 1] < 128).sum(axis=0)
    assert height[int(right) - 6] >= height[int(left) + 10] + 2
    assert np.average(np.arange(SIZE[1]) + 0.5, weights=255.0 - image[..., 1].mean(axis=1)) == pytest.approx(
        rows[0], abs=0.5
    )


def test_what_is_outside_the_picture_or_behind_the_camera_is_not_drawn() -> None:
    image = white()
    stroke(image, np.array([[-50.0, -50.0], [-10.0, -20.0], [np.nan, 3.0], [40.0, 40.0]]), RED)
    camera = Camera(eye=(2.0, 0.0, 0.0), target=(0.0, 0.0, 0.0))
    arrow(image, camera, np.array([3.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0]), RED)
    assert (image == 255).all()
