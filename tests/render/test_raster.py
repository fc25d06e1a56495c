"""Depth, parts and angles of pictures, against planes, spheres and boxes met by rays in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.render.lens import Lens
from manipcli.render.raster import Fragments, Raster
from manipcli.render.surface import Surface, box_surface, sphere_surface, surface
from manipcli.shapes.primitives import Box, Sphere

LENS = Lens.of_field(160, 120, math.radians(70.0))
LIGHT = np.array([0.0, 0.0, -1.0])
DEVIATION = 1e-4


def rays(lens: Lens) -> Array:
    """(h, w, 3) by the matrix K of the pinhole, at z = 1."""
    K = np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])
    u, v = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
    return np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T


def seen(*placed: tuple[Surface, Transform], lens: Lens = LENS, near: float = 1e-3) -> Fragments:
    raster = Raster([each for each, _ in placed], lens, near)
    return raster.see(np.array([X.R for _, X in placed]), np.array([X.p for _, X in placed]), LIGHT)


def on_sphere(d: Array, centre: Array, radius: float) -> Array:
    """(h, w) depth at which rays d enter a sphere; infinite beside it."""
    a, b, c = (d * d).sum(axis=-1), d @ centre, centre @ centre - radius**2
    inside = b * b - a * c
    return np.where(inside >= 0.0, (b - np.sqrt(np.maximum(inside, 0.0))) / a, np.inf)


def on_box(d: Array, X_CB: Transform, size: Array) -> Array:
    """(h, w) depth at which rays d enter a box, by its slabs."""
    origin, along = -X_CB.R.T @ X_CB.p, d @ X_CB.R
    with np.errstate(divide="ignore"):
        ends = np.stack([(side * size / 2.0 - origin) / along for side in (-1.0, 1.0)])
    enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
    return np.where(enter <= leave, enter, np.inf)


def test_depth_of_a_plane_is_exact_along_every_ray() -> None:
    X = Transform.of(xyz=(0.1, 0.2, 1.5), rpy=(0.5, -0.3, 0.2))
    plane = surface([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
    found, d = seen((plane, X)), rays(LENS)
    normal = X.R[:, 2]
    expected = (normal @ X.p) / (d @ normal)
    hit = np.isfinite(found.depth)
    assert hit.mean() > 0.9
    assert np.abs(found.depth - expected)[hit].max() < 1e-9
    cosine = np.abs(d @ normal) / np.linalg.norm(d, axis=-1)
    assert np.abs(found.slope / np.linalg.norm(d, axis=-1) - cosine)[hit].max() < 1e-9


@pytest.mark.parametrize("radius", [0.014, 0.2, 1.0])
def test_depth_of_a_sphere_is_within_a_millimetre(radius: float) -> None:
    centre = np.array([0.02, -0.05, 1.0]) * 4.0 * radius
    ball = sphere_surface(Sphere(radius), DEVIATION)
    found, expected = seen((ball, Transform.of(xyz=centre))), on_sphere(rays(LENS), centre, radius)
    hit = np.isfinite(found.depth)
    assert (hit & ~np.isfinite(expected)).sum() == 0, "chords lie within the sphere"
    assert hit.sum() > 0.9 * np.isfinite(expected).sum()
    # Across the surface by the deviation of its chords in both directions; along a ray, by that over the cosine.
    d = rays(LENS)[hit]
    points = expected[hit][:, None] * d
    cosine = np.abs(((points - centre) / radius * d).sum(axis=1)) / np.linalg.norm(d, axis=1)
    steep = cosine > 0.3
    error = found.depth[hit] - expected[hit]
    assert np.abs(error[steep]).max() < 1e-3
    assert error.min() > -1e-9


def test_depth_of_a_box_is_exact_and_the_nearer_of_two_is_seen() -> None:
    size = np.array([0.3, 0.2, 0.4])
    near, far = (Transform.of(xyz=(0.05, 0.0, z), rpy=(0.4, 0.7, -0.2)) for z in (0.8, 1.1))
    box = box_surface(Box((0.3, 0.2, 0.4)))
    found, d = seen((box, far), (box, near)), rays(LENS)
    first, second = on_box(d, near, size), on_box(d, far, size)
    expected = np.minimum(first, second)
    both = np.isfinite(found.depth) & np.isfinite(expected)
    assert (np.isfinite(found.depth) != np.isfinite(expected)).sum() <= 2, "but for rays through an edge"
    assert np.abs(found.depth[both] - expected[both]).max() < 1e-9
    assert np.array_equal((found.face >= 12)[both], (first < second)[both])


def test_no_ray_passes_between_triangles() -> None:
    """A camera within a sphere and within a box sees no gap, whatever crosses its plane z = 0."""
    rng = np.random.default_rng(3)
    for shape in (sphere_surface(Sphere(0.5)), box_surface(Box((1.0, 0.7, 0.9)))):
        for _ in range(5):
            X = Transform.of(xyz=rng.uniform(-0.2, 0.2, 3), rpy=rng.uniform(-3.0, 3.0, 3))
            assert np.isfinite(seen((shape, X)).depth).all()


def test_what_is_nearer_than_the_near_plane_is_not_seen() -> None:
    housing, wall = (box_surface(Box((2.0, 2.0, 0.01))) for _ in range(2))
    found = seen((housing, Transform.of(xyz=(0.0, 0.0, 0.02))), (wall, Transform.of(xyz=(0.0, 0.0, 1.005))), near=0.05)
    assert found.depth[60, 80] == pytest.approx(1.0, abs=1e-12)


def test_a_part_of_the_view_is_that_part_of_the_picture() -> None:
    """A lens with another principal point sees the same through the same pixels; nothing of the whole is cut away."""
    X = Transform.of(xyz=(0.3, 0.1, 0.9), rpy=(0.3, 0.2, 0.1))
    ball = sphere_surface(Sphere(0.3))
    part = Lens(40, 30, LENS.fx, LENS.fy, LENS.cx - 100, LENS.cy - 60)
    whole, cut = seen((ball, X)), seen((ball, X), lens=part)
    assert np.abs(np.nan_to_num(whole.depth[60:90, 100:140] - cut.depth)).max() < 1e-12
