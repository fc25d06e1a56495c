"""Antipodal pairs of points on the triangles of a mesh: where two fingers hold it by friction.

A point is drawn uniformly on the surface, and the line through it along its normal is followed through the mesh to the
last face on the other side. The pair is kept if the line lies in the friction cone of that face, too: then two fingers
that press along the line do not slip (Nguyen, Constructing force-closure grasps, IJRR 7(3), 1988).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.scene import Body
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.primitives import Mesh

POINTS: Final = 200
"""Points that are drawn."""
PAIRS: Final = 12
"""Maximum number of pairs."""
CONE: Final = math.radians(20.0)
"""[rad] Half angle of the friction cone: a coefficient of 0.36, less than of most fingers on most objects."""
APART: Final = 0.01
"""[m] Pairs whose middles are nearer than this, and whose lines differ by less than 20 deg, count as the same."""
TRIANGLES: Final = 20000
"""Meshes with more triangles are not sampled."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Two opposite points in the body's frame: their `middle` (3,) [m], the unit `axis` (3,) and the `width` [m]."""

    middle: Array
    axis: Array
    width: float


def antipodal_pairs(body: Body) -> tuple[Pair, ...]:
    """Pairs of a body's meshes, those whose middle is nearest to the centre of mass first; always the same ones."""
    corners = [
        _triangles(geometry.shape.path, geometry.shape.scale) @ geometry.X_LS.R.T + geometry.X_LS.p
        for geometry in body.geometries
        if isinstance(geometry.shape, Mesh)
    ]
    if not corners or sum(map(len, corners)) > TRIANGLES:
        return ()
    pairs = sampled(np.concatenate(corners), np.random.default_rng(0))
    pairs.sort(key=lambda pair: float(np.linalg.norm(pair.middle - body.X_OI.p)))
    kept: list[Pair] = []
    for pair in pairs:
        if not any(_same(pair, other) for other in kept):
            kept.append(pair)
    return tuple(kept[:PAIRS])


def sampled(corners: Array, rng: np.random.Generator, count: int = POINTS) -> list[Pair]:
    """Pairs from `count` random points on triangles.

    Args:
        corners: (m, 3, 3) the three corners of each triangle [m].
        rng: draws the points.
        count: number of points.
    """
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    crossed = np.cross(second - first, third - first)
    doubled = np.linalg.norm(crossed, axis=1)
    whole = doubled > 1e-12
    first, second, third, crossed, doubled = (a[whole] for a in (first, second, third, crossed, doubled))
    if not len(first):
        return []
    normals = crossed / doubled[:, None]
    chosen = rng.choice(len(first), size=count, p=doubled / doubled.sum())
    u, v = rng.random(count), rng.random(count)
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points = first[chosen] + u[:, None] * (second - first)[chosen] + v[:, None] * (third - first)[chosen]
    found: list[Pair] = []
    for point, k in zip(points, chosen.tolist(), strict=True):
        # The winding of a mesh is not always outward: the line is followed in both directions.
        along = _hits(point, normals[k], first, second - first, third - first)
        along[k] = math.nan
        if np.isnan(along).all():
            continue
        far = int(np.nanargmax(np.abs(along)))
        width = abs(float(along[far]))
        if width > 1e-4 and abs(float(normals[k] @ normals[far])) >= math.cos(CONE):
            found.append(Pair(point + 0.5 * along[far] * normals[k], normals[k], width))
    return found


def _hits(point: Array, direction: Array, first: Array, e1: Array, e2: Array) -> Array:
    """(m) Where the line point + t direction meets each triangle, else nan (Moeller and Trumbore, 1997)."""
    h = np.cross(direction, e2)
    a = np.einsum("ij,ij->i", e1, h)
    with np.errstate(divide="ignore", invalid="ignore"):
        f = 1.0 / a
        s = point - first
        u = f * np.einsum("ij,ij->i", s, h)
        q = np.cross(s, e1)
        v = f * (q @ direction)
        t = f * np.einsum("ij,ij->i", e2, q)
        inside = (np.abs(a) > 1e-15) & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    return np.where(inside, t, math.nan)


def _same(a: Pair, b: Pair) -> bool:
    return abs(float(a.axis @ b.axis)) > math.cos(CONE) and float(np.linalg.norm(a.middle - b.middle)) < APART


@functools.lru_cache(maxsize=16)
def _triangles(path: Path, scale: tuple[float, float, float]) -> Array:
    """(m, 3, 3) corners of a mesh [m]."""
    mesh = read_mesh(path)
    corners: Array = mesh.vertices[mesh.faces] * np.array(scale)
    return corners
