"""How a peg fits into a hole: the section of the part that enters, against the opening of the hole.

The hole is the `Interior` of a container, a box or an upright cylinder; of a hollow of another shape, the part of it
that reaches down from the rim. The peg stands upright, with the middle of its lowest section on the axis of the hole.
The clearance is the way that it can move to the side from there, in the narrowest direction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.scene.scene import Body, Interior
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Sphere
from manipcli.shapes.surface import hull

EDGE = 1e-9
"""[m] Below this a section has no height."""
SAME = 1e-6
"""[m] Clearances that differ by less are the same."""
YAWS_DEG = (0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 135.0, -135.0, 180.0)
"""Rotations about the hole, relative to how the peg is held."""
RING = 64
"""Points on the edge of a tilted cylinder."""


@dataclass(frozen=True, slots=True)
class Section:
    """Discs that cover the outline of the part that enters, seen along z of O.

    Attributes:
        points: (k, 2) [m] their centres.
        radii: (k) [m].
        bottom: [m] height of the lowest point in O.
    """

    points: Array
    radii: Array
    bottom: float

    @property
    def middle(self) -> Array:
        """(2,) [m] of the bounding box."""
        low, high = self.points - self.radii[:, None], self.points + self.radii[:, None]
        return np.asarray((low.min(axis=0) + high.max(axis=0)) / 2.0)


@dataclass(frozen=True, slots=True)
class Fit:
    """A peg in a hole.

    Attributes:
        clearance: [m] to each side; negative: it does not go in.
        wide: [m] width of the part that enters: a diameter, or of a box the larger side.
        room: [m] the same of the hole.
        depth: [m] of the hole, from its rim to its floor.
    """

    clearance: float
    wide: float
    room: float
    depth: float


def section(body: Body, depth: float) -> Section:
    """The section of the lowest `depth` [m] of a body."""
    bottom = float(body.centre[2] - body.size[2] / 2.0)
    points, radii = [], []
    for geometry in body.geometries:
        found, radius = _below(geometry, bottom + depth)
        points.append(found)
        radii.append(np.full(len(found), radius))
    return Section(np.concatenate(points), np.concatenate(radii), bottom)


def deep(interior: Interior) -> float:
    """[m] From the rim of a hollow to its floor."""
    return interior.rim - interior.floor


def fit(peg: Section, interior: Interior, yaw: float = 0.0) -> Fit:
    """A section, rotated by `yaw` [rad] about the axis of the hole, in the hollow of a container."""
    c, s = math.cos(yaw), math.sin(yaw)
    points = (peg.points - peg.middle) @ np.array([[c, s], [-s, c]])
    if isinstance(interior.shape, Cylinder):
        radius = float(np.max(np.linalg.norm(points, axis=1) + peg.radii))
        return Fit(interior.shape.radius - radius, 2.0 * radius, 2.0 * interior.shape.radius, deep(interior))
    half = (np.abs(points) + peg.radii[:, None]).max(axis=0)
    room = np.array(interior.shape.size[:2]) / 2.0
    k = int(np.argmin(room - half))
    return Fit(float(room[k] - half[k]), 2.0 * float(half[k]), 2.0 * float(room[k]), deep(interior))


def best_yaws(peg: Section, interior: Interior, now: float) -> tuple[float, ...]:
    """Yaws [rad] of the peg in the hole with the most clearance, the nearest to `now` first: of a round one many."""
    turns = np.array([*(now + np.radians(YAWS_DEG)), *(np.arange(4) * math.pi / 2.0)])
    clearances = np.array([fit(peg, interior, yaw).clearance for yaw in turns])
    best = turns[clearances > clearances.max() - SAME]
    return tuple(sorted((float(yaw) for yaw in best), key=lambda yaw: abs(math.remainder(yaw - now, math.tau))))


def _below(geometry: Geometry, top: float) -> tuple[Array, float]:
    """Points (k, 2) [m] of a convex shape below z = `top` in O, and the radius about each; k may be 0."""
    shape, X = geometry.X_LS, geometry.shape
    match X:
        case Sphere(radius):
            return _disc(shape.p, shape.p[2] - radius, top, radius)
        case Cylinder(radius, length) if abs(shape.R[2, 2]) > 1.0 - 1e-9:
            return _disc(shape.p, shape.p[2] - length / 2.0, top, radius)
    corners, edges = _edges(X)
    at = shape.apply(corners)
    low = at[:, 2] <= top + EDGE
    crossing = [
        at[a] + (top - at[a, 2]) / (at[b, 2] - at[a, 2]) * (at[b] - at[a]) for a, b in edges if low[a] != low[b]
    ]
    return np.concatenate([at[low][:, :2], np.array(crossing).reshape(-1, 3)[:, :2]]), 0.0


def _disc(p: Array, low: float, top: float, radius: float) -> tuple[Array, float]:
    return (np.array([p[:2]]) if low < top - EDGE else np.zeros((0, 2))), radius


def _edges(shape: Box | Cylinder | Mesh | Sphere) -> tuple[Array, Sequence[tuple[int, int]]]:
    """Corners (k, 3) of a convex shape in its frame, and pairs of them between which its edges lie."""
    if isinstance(shape, Mesh):
        if shape.part is not None:
            points, faces = np.array(shape.part.points), shape.part.triangles
        else:
            found = hull(read_mesh(shape.path).vertices)
            points, faces = (np.zeros((0, 3)), ()) if found is None else (found[0], tuple(map(tuple, found[1])))
        pairs = {tuple(sorted(pair)) for face in faces for pair in combinations(face, 2)}
        return points * np.array(shape.scale), sorted((int(a), int(b)) for a, b in pairs)
    if isinstance(shape, Cylinder):
        angles = 2.0 * math.pi * np.arange(RING) / RING
        # Outside of the circle, so that the edges between them touch it.
        ring = shape.radius / math.cos(math.pi / RING) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        half = np.full((RING, 1), shape.length / 2.0)
        corners = np.concatenate([np.hstack([ring, half]), np.hstack([ring, -half])])
        return corners, [(k, k + RING) for k in range(RING)] + _ring(0) + _ring(RING)
    assert isinstance(shape, Box)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    pairs_of_box = [(a, b) for a, b in combinations(range(8), 2) if np.sum(signs[a] != signs[b]) == 1]
    return signs * np.array(shape.size) / 2.0, pairs_of_box


def _ring(first: int) -> list[tuple[int, int]]:
    return [(first + k, first + (k + 1) % RING) for k in range(RING)]


def upright(peg: Section, X_WS: Transform, height: float, yaw: float) -> Transform:
    """X_WO of a peg that stands over a hole: its middle on the axis z of S, its bottom at `height` [m] in S."""
    turned = X_WS @ Transform.of(rpy=(0.0, 0.0, yaw), xyz=(0.0, 0.0, height))
    return turned @ Transform.of(xyz=(-peg.middle[0], -peg.middle[1], -peg.bottom))
