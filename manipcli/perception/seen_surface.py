"""What a camera can see of a body: one triangle surface, and whether it looks the same after rotations."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array, matrix_from_axis_angle
from manipcli.render.drawing import shape_surfaces
from manipcli.render.lens import Lens
from manipcli.render.raster import Raster
from manipcli.render.stage import DEVIATION
from manipcli.render.surface import Surface, surface
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Geometry, Shape, drawn_once

if TYPE_CHECKING:
    from scipy.spatial import KDTree

PIXELS, AWAY = 64, 4.0
"""Of the pictures that sample what is visible: rows and columns, and the distance in radii of the body."""
ELEVATIONS, AZIMUTHS = (-0.7, 0.7, 1.3), 12
"""[rad] Elevations of their cameras, and the number of azimuths."""
ANY = tuple(k * math.pi * (3.0 - math.sqrt(5.0)) for k in range(1, 7))
"""Multiples of the golden angle [rad]: no symmetry has two of them."""
SAME, MOST_OTHER = 0.035, 0.01
"""A body looks the same if at most a share of MOST_OTHER of its points is off by more than SAME of its radius."""


@lru_cache(maxsize=32)
def seen_surface(geometries: tuple[Geometry, ...]) -> Surface:
    """The visible shapes in O as one surface; without triangles if nothing can be drawn."""
    parts: dict[Shape, tuple[Surface, ...]] = {}
    vertices, faces, first = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int32)], 0
    for geometry in drawn_once(geometries):
        if geometry.rgba is not None and geometry.rgba[3] <= 0.0:
            continue
        if geometry.shape not in parts:
            try:
                parts[geometry.shape] = shape_surfaces(geometry.shape, deviation=DEVIATION)
            except UnusableMesh:
                parts[geometry.shape] = ()
        for part in parts[geometry.shape]:
            vertices.append(geometry.X_LS.apply(part.vertices))
            faces.append(part.faces + first)
            first += len(part.vertices)
    return surface(np.concatenate(vertices), np.concatenate(faces))


def key(axis: Array) -> tuple[float, float, float]:
    """An axis (3,) without rounding errors."""
    x, y, z = (float(v) for v in np.round(axis, 6))
    return x, y, z


def looks_same(
    geometries: tuple[Geometry, ...], axis: tuple[float, float, float], angles: tuple[float, ...] = ANY
) -> bool:
    """Whether a body looks the same after rotations [rad] about an axis through O's origin [default: after any]."""
    points, tree, radius = _visible(geometries)
    for angle in angles:
        far = tree.query(points @ matrix_from_axis_angle(axis, angle).T)[0] > SAME * radius
        if far.mean() > MOST_OTHER:
            return False
    return True


@lru_cache(maxsize=32)
def _visible(geometries: tuple[Geometry, ...]) -> tuple[Array, KDTree, float]:
    """Some visible points (n, 3), a tree of all, and the radius of the body about O [m]."""
    from scipy.spatial import KDTree

    shown = seen_surface(geometries)
    radius = float(np.linalg.norm(shown.vertices, axis=1).max())
    points = _visible_points(shown, radius)
    return points[:: max(1, len(points) // 1500)], KDTree(points), radius


def _visible_points(shown: Surface, radius: float) -> Array:
    """(n, 3) points that cameras around it see: inner faces of overlapping shapes have none."""
    lens = Lens.of_field(PIXELS, PIXELS, 2.0 * math.asin(1.0 / AWAY))
    raster, found = Raster([shown], lens), []
    for elevation in ELEVATIONS:
        for k in range(AZIMUTHS):
            azimuth = 2.0 * math.pi * k / AZIMUTHS
            z = -np.array([math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth),
                           math.sin(elevation)])  # fmt: skip
            x = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
            R_OC = np.stack([x, np.cross(z, x), z], axis=1)
            depth = raster.see(R_OC.T[None], np.array([[0.0, 0.0, AWAY * radius]]), z).depth
            cloud = np.asarray(lens.points(depth))[np.isfinite(depth)]
            found.append((cloud - [0.0, 0.0, AWAY * radius]) @ R_OC.T)
    return np.concatenate(found)
