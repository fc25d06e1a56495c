"""Rays, projections and points of a pinhole, against its matrix."""

from __future__ import annotations

import math

import numpy as np

from manipcli.render.lens import Lens


def test_projections_are_those_of_the_matrix_of_the_pinhole() -> None:
    lens = Lens(320, 240, 300.0, 310.0, 150.5, 119.0)
    points = np.random.default_rng(0).uniform((-1.0, -1.0, 0.5), (1.0, 1.0, 3.0), (50, 3))
    image = points @ np.array([[300.0, 0.0, 150.5], [0.0, 310.0, 119.0], [0.0, 0.0, 1.0]]).T
    assert np.allclose(lens.project(points), image[:, :2] / image[:, 2:])


def test_points_of_depths_project_to_their_pixels() -> None:
    lens = Lens.of_field(8, 6, math.radians(80.0))
    depth = np.random.default_rng(1).uniform(0.3, 2.0, (6, 8))
    u, v = np.meshgrid(np.arange(8), np.arange(6))
    assert np.allclose(lens.project(lens.points(depth)), np.stack([u, v], axis=-1))


def test_the_field_of_view_is_from_edge_to_edge() -> None:
    lens = Lens.of_field(320, 240, math.radians(60.0))
    left, right = ((column - lens.cx) / lens.fx for column in (-0.5, 319.5))
    assert math.isclose(math.atan(right) - math.atan(left), math.radians(60.0))
