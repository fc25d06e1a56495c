"""Triangles: closed, outwards, with the volume of what they stand for, and shaded round only where it is round."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.render.surface import Surface, box_surface, cylinder_surface, smoothed, sphere_surface
from manipcli.shapes.primitives import Box, Cylinder, Sphere


def _volume(surface: Surface) -> float:
    """By the divergence theorem: positive only if the faces look outwards."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


SHAPES = [
    (box_surface(Box((0.2, 0.3, 0.4))), 0.2 * 0.3 * 0.4, 1e-12),
    # Chords of 48 segments: an area 1 - sin(x) / x with x = 2 pi / 48 too small, twice for a sphere.
    (sphere_surface(Sphere(0.3)), 4.0 / 3.0 * math.pi * 0.3**3, 8e-3),
    (cylinder_surface(Cylinder(0.2, 0.5)), math.pi * 0.2**2 * 0.5, 3e-3),
]


@pytest.mark.parametrize(("surface", "volume", "relative"), SHAPES, ids=["box", "sphere", "cylinder"])
def test_a_shape_is_closed_outwards_and_as_large_as_it_says(surface: Surface, volume: float, relative: float) -> None:
    assert _volume(surface) == pytest.approx(volume, rel=relative)
    outwards = surface.vertices + 1e-3 * surface.normals
    assert np.all(np.linalg.norm(outwards, axis=1) > np.linalg.norm(surface.vertices, axis=1))


def test_a_mirrored_surface_still_looks_outwards() -> None:
    box = box_surface(Box((0.2, 0.3, 0.4)))
    mirrored = box.scaled((-1.0, 1.0, 2.0))
    assert _volume(mirrored) == pytest.approx(2.0 * _volume(box))
    moved = mirrored.moved(Transform.of(xyz=(1.0, 2.0, 3.0), rpy=(0.3, 0.2, 0.1)))
    assert _volume(moved) == pytest.approx(_volume(mirrored), rel=1e-9)


def _cube_of_corners() -> tuple[Array, Array]:
    """As STL has it: three vertices a triangle, nothing shared."""
    box = box_surface(Box((1.0, 1.0, 1.0)))
    points = box.vertices[box.faces.ravel()]
    return points, np.arange(len(points)).reshape(-1, 3)


def test_edges_stay_sharp_and_flat_sides_are_shared() -> None:
    cube = smoothed(*_cube_of_corners())
    assert len(cube.vertices) == 6 * 4  # four corners a side, shared by its two triangles only
    assert np.abs(cube.normals).max(axis=1) == pytest.approx(np.ones(24))


def test_a_round_surface_is_shared_whatever_the_file_shares() -> None:
    ball = sphere_surface(Sphere(1.0))
    points = ball.vertices[ball.faces.ravel()]
    again = smoothed(points, np.arange(len(points)).reshape(-1, 3))
    assert len(again.vertices) == len(ball.vertices)
    assert np.einsum("ij,ij->i", again.normals, again.vertices).min() > 0.995  # a sphere's normals are its points


def test_triangles_without_an_area_are_left_out() -> None:
    flat = smoothed([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]])
    assert len(flat.faces) == 1
    assert len(smoothed([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]).faces) == 0
