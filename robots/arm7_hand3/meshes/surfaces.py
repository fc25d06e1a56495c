"""Triangulated surfaces with normals: skins of implicit solids, lathed profiles, lofted sections. Units: metres."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Solid = Callable[[Array], Array]
"""Signed distance of points (..., 3) to a surface: negative inside, a lower bound of the true distance outside."""


@dataclass(frozen=True, slots=True)
class Surface:
    """`points` (n, 3), unit `normals` (n, 3), `faces` (m, 3): anticlockwise seen from outside."""

    points: Array
    normals: Array
    faces: npt.NDArray[np.int64]

    def moved(self, rotation: Array, translation: Sequence[float] = (0.0, 0.0, 0.0)) -> Surface:
        """The surface rotated (3, 3), then translated (3,)."""
        return Surface(self.points @ rotation.T + np.asarray(translation), self.normals @ rotation.T, self.faces)


def join(surfaces: Sequence[Surface]) -> Surface:
    """Several surfaces as one."""
    starts = np.cumsum([0] + [len(surface.points) for surface in surfaces[:-1]])
    return Surface(
        np.concatenate([surface.points for surface in surfaces]),
        np.concatenate([surface.normals for surface in surfaces]),
        np.concatenate([surface.faces + start for surface, start in zip(surfaces, starts, strict=True)]),
    )


def rotation_x(angle: float) -> Array:
    """Rotation (3, 3) about x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


# --- implicit solids -------------------------------------------------------------------------------------------------


def smooth_min(a: Array, b: Array, radius: float) -> Array:
    """Union with a fillet: min(a, b) - h^2 radius / 4, h = max(radius - |a - b|, 0) / radius (Quilez, polynomial)."""
    h = np.maximum(radius - np.abs(a - b), 0.0) / radius
    return np.minimum(a, b) - h * h * radius / 4.0


def smooth_max(a: Array, b: Array, radius: float) -> Array:
    """Intersection with a rounded edge."""
    return -smooth_min(-a, -b, radius)


def rounded_cylinder(radial: Array, axial: Array, radius: float, half_length: float, fillet: float) -> Array:
    """Cylinder with rounded rims; `radial` and `axial` are a point's distances from its axis and its middle plane."""
    u, v = radial - (radius - fillet), np.abs(axial) - (half_length - fillet)
    outside: Array = np.hypot(np.maximum(u, 0.0), np.maximum(v, 0.0))
    return outside + np.minimum(np.maximum(u, v), 0.0) - fillet


def gradient(solid: Solid, points: Array, step: float = 1e-5) -> Array:
    """Unit outward normals (..., 3) by central differences."""
    offsets = step * np.eye(3)
    slope = np.stack([solid(points + offset) - solid(points - offset) for offset in offsets], axis=-1)
    return np.asarray(slope / np.linalg.norm(slope, axis=-1, keepdims=True))


def skin(solid: Solid, origins: Array, directions: Array) -> Surface:
    """Where rays from inside first leave a solid, as a grid closed round its columns.

    Args:
        solid: what to cover.
        origins: (rows, 1, 3) inside the solid.
        directions: (rows, columns, 3) unit; columns run anticlockwise about the direction in which the rows advance.
    """
    travelled = np.zeros(directions.shape[:2])
    for _ in range(200):
        travelled -= solid(origins + travelled[..., None] * directions)
    points = origins + travelled[..., None] * directions
    return grid(points, gradient(solid, points))


# --- grids -----------------------------------------------------------------------------------------------------------


def grid(points: Array, normals: Array) -> Surface:
    """Rows x columns points (rows, columns, 3), closed round the columns; slivers without area are left out."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    right = np.roll(index, -1, axis=1)
    low, low_right, high_right, high = (corner.ravel() for corner in (index[:-1], right[:-1], right[1:], index[1:]))
    faces = np.concatenate([np.stack([low, low_right, high_right], 1), np.stack([low, high_right, high], 1)])
    flat = points.reshape(-1, 3)
    a, b, c = flat[faces].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return Surface(flat, normals.reshape(-1, 3), faces[area > 1e-10])


def lathe(profile: Sequence[tuple[float, float]], columns: int = 36, crease: float = 40.0) -> Surface:
    """A profile of (radius, z) turned about z; corners sharper than `crease` degrees keep a hard edge.

    The profile runs so that its outside is to the right: upwards along the outer wall.
    """
    line = np.array(profile, dtype=float)
    edges = np.diff(line, axis=0)
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1)
    strips: list[tuple[list[Array], list[Array]]] = [([line[0]], [outward[0]])]
    for k in range(1, len(line)):
        last = k == len(line) - 1
        hard = not last and float(outward[k - 1] @ outward[k]) < np.cos(np.radians(crease))
        mean = outward[k - 1] if last or hard else outward[k - 1] + outward[k]
        strips[-1][0].append(line[k])
        strips[-1][1].append(mean / np.linalg.norm(mean))
        if hard:
            strips.append(([line[k]], [outward[k]]))
    turn = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)

    def turned(values: list[Array]) -> Array:
        radius, z = np.array(values).T
        around = np.ones(columns)
        return np.stack([np.outer(radius, np.cos(turn)), np.outer(radius, np.sin(turn)), np.outer(z, around)], axis=-1)

    return join([grid(turned(points), turned(normals)) for points, normals in strips])


def loft(sections: Sequence[Array], heights: Sequence[float]) -> Surface:
    """Outlines (columns, 2), anticlockwise, stacked at `heights` along z, closed below and above; flat normals.

    Made for STL, which keeps none of the normals.
    """
    rings = [np.column_stack([outline, np.full(len(outline), z)]) for outline, z in zip(sections, heights, strict=True)]
    low, high = rings[0].mean(axis=0), rings[-1].mean(axis=0)
    columns = len(rings[0])
    points = np.stack([np.repeat(low[None], columns, 0), *rings, np.repeat(high[None], columns, 0)])
    return grid(points, np.zeros_like(points))


def rounded_rectangle(x: float, y: float, fillet: float, corner_points: int = 5, centre_y: float = 0.0) -> Array:
    """Outline (4 corner_points, 2) of a rectangle of full widths x and y, anticlockwise."""
    quarter = np.linspace(0.0, np.pi / 2.0, corner_points)
    corners = [(1, 1, 0.0), (-1, 1, 0.5), (-1, -1, 1.0), (1, -1, 1.5)]
    return np.concatenate(
        [
            np.column_stack(
                [
                    sx * (x / 2.0 - fillet) + fillet * np.cos(quarter + turn * np.pi),
                    centre_y + sy * (y / 2.0 - fillet) + fillet * np.sin(quarter + turn * np.pi),
                ]
            )
            for sx, sy, turn in corners
        ]
    )
