"""The hollow of a body of any shape, found by rays against its contact shapes.

From points above the body, a ray falls to the first shape: a floor. At each height above it, level rays go out in all
directions. Where all meet a shape, the section is closed; the rim is the height up to which all sections are. What is
found is what would hold water, as seen from the axis. Of all floors, the largest hollow counts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.description.lint.rigid import box_about
from manipcli.scene.scene import Interior
from manipcli.scene.walls import Walls
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Sphere
from manipcli.shapes.surface import hull, welded

RAYS: Final = 64
LEVELS: Final = 24
AXES: Final = 7
"""Trial axes along x and along y; the best is then moved to the middle of its opening."""
COARSE: Final = 16, 8
"""Rays and levels of a trial."""
TIGHT: Final = 1e-3
"""By this share of the body's size its shapes are thicker for the rays, so that none passes between two of them."""
LEAST: Final = 0.02
"""A hollow that is shallower or narrower than this share of the body's size is a dent."""
PRISM: Final = 0.93
"""Where a box or a cylinder fills this share of the hollow, the hollow is one: a polygon of 8 sides fills 0.95."""
_ROUND: Final = 48  # planes for a round shape

Planes = tuple[Array, Array]
"""Outward normals (n, 3) and offsets (n) [m] of a convex shape: n . x <= d inside."""


def hollow_of(geometries: Sequence[Geometry]) -> Interior | None:
    """The hollow of shapes in the frame O of a body, open upwards (+z of O); None without one."""
    shapes = [planes for each in geometries if (planes := _planes(each)) is not None]
    if len(shapes) < 2:
        return None  # a convex shape has no hollow
    low, high = _bounds(geometries)
    size = float(np.max(high - low))
    thick = TIGHT * size
    shapes = [(normals, offsets + thick) for normals, offsets in shapes]
    shares = (np.arange(AXES) + 0.5) / AXES
    trials = [(x, y) for x in low[0] + shares * (high - low)[0] for y in low[1] + shares * (high - low)[1]]
    trials.append(((low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0))
    trial = max((_section(shapes, at, low, high, *COARSE) for at in trials), key=_volume)
    found = None if trial is None else _section(shapes, _middle(trial), low, high, RAYS, LEVELS)
    if found is None:
        return None
    found = _section(shapes, _middle(found), low, high, RAYS, LEVELS) or found
    at, levels, radii = found
    radii, levels = radii + thick, levels - thick * np.array([1.0, *np.zeros(len(levels) - 1)])
    if levels[-1] - levels[0] < LEAST * size or float(radii[-1].min()) < LEAST * size:
        return None
    return _interior(at, levels, radii)


Section = tuple[tuple[float, float], Array, Array]
"""The axis (x, y), levels (K) from the floor to the rim, and the way (K, N) to the wall at each."""


def _section(
    shapes: Sequence[Planes], at: tuple[float, float], low: Array, high: Array, rays: int, levels: int
) -> Section | None:
    """The closed sections about an upright axis; None if there is no floor or no closed section on it."""
    above = np.array([*at, high[2] + 1.0])
    fall = float(_cast(shapes, above[None], np.array([[0.0, 0.0, -1.0]]))[0])
    if not math.isfinite(fall):
        return None
    floor = float(above[2]) - fall
    angles = 2.0 * math.pi * np.arange(rays) / rays
    out = np.stack([np.cos(angles), np.sin(angles), np.zeros(rays)], axis=1)

    def ways(heights: Array) -> Array:
        starts = np.repeat(np.column_stack([np.tile(at, (len(heights), 1)), heights]), rays, axis=0)
        return _cast(shapes, starts, np.tile(out, (len(heights), 1))).reshape(len(heights), rays)

    step = (float(high[2]) - floor) / levels
    if step <= 0.0:
        return None
    heights: Array = floor + step * (np.arange(levels, dtype=np.float64) + 0.5)
    closed = np.isfinite(ways(heights)).all(axis=1)
    count = int(np.argmin(closed)) if not closed.all() else levels
    if count == 0:
        return None
    rim, over = float(heights[count - 1]), float(heights[count]) if count < levels else float(high[2]) + 2e-3
    while over - rim > 1e-5:
        middle = (rim + over) / 2.0
        rim, over = (middle, over) if np.isfinite(ways(np.array([middle]))).all() else (rim, middle)
    rim -= float(np.max(high - low)) * TIGHT  # the shapes are thicker upwards too
    if rim <= floor:
        return None
    heights = np.linspace(floor, rim, levels)
    heights[0] += 1e-3 * (rim - floor)  # just above the floor
    found = ways(heights)
    return (at, np.array([floor, *heights[1:]]), found) if np.isfinite(found).all() else None


def _volume(section: Section | None) -> float:
    if section is None:
        return 0.0
    _, levels, radii = section
    return float(_areas(radii).mean() * (levels[-1] - levels[0]))


def _areas(radii: Array) -> Array:
    """(K) [m2] of polygons with corners at radii (K, N)."""
    return np.asarray(
        0.5 * math.sin(2.0 * math.pi / radii.shape[1]) * np.sum(radii * np.roll(radii, -1, axis=1), axis=1)
    )


def _middle(section: Section) -> tuple[float, float]:
    """The centre of the area of the rim."""
    (x, y), _, radii = section
    r = radii[-1]
    angles = 2.0 * math.pi * np.arange(len(r)) / len(r)
    a = np.stack([r * np.cos(angles), r * np.sin(angles)], axis=1)
    b = np.roll(a, -1, axis=0)
    weights = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    dx, dy = ((a + b) * weights[:, None]).sum(axis=0) / 3.0 / weights.sum()
    return float(x + dx), float(y + dy)


def _interior(at: tuple[float, float], levels: Array, radii: Array) -> Interior:
    """The largest upright box or cylinder from the rim down, and the walls where it is not all of the hollow."""
    whole = float(_areas(radii).mean() * (levels[-1] - levels[0]))
    best: tuple[float, Box | Cylinder] = (0.0, Cylinder(0.0, 0.0))
    for k in range(len(levels) - 1):
        least, depth = radii[k:].min(axis=0), float(levels[-1] - levels[k])
        r = float(least.min())
        x, y = _rectangle(least)
        # Between two corners the wall is nearer than at them.
        round_ = Cylinder(r * math.cos(math.pi / len(least)), depth)
        box = Box((2.0 * x, 2.0 * y, depth))
        best = max(best, (math.pi * r * r * depth, round_), (4.0 * x * y * depth, box), key=lambda each: each[0])
    volume, shape = best
    depth = shape.length if isinstance(shape, Cylinder) else shape.size[2]
    top = float(levels[-1])
    X_OS = Transform.of(xyz=(*at, top - depth / 2.0))
    if volume >= PRISM * whole:
        return Interior(X_OS=X_OS, shape=shape)
    heights = tuple(float(level) for level in levels - X_OS.p[2])
    return Interior(X_OS, shape, Walls(heights, tuple(tuple(float(r) for r in section) for section in radii)))


def _rectangle(radii: Array) -> tuple[float, float]:
    """Half sizes (x, y) [m] of the largest rectangle along x and y about the axis with no corner of the wall in it."""
    angles = 2.0 * math.pi * np.arange(len(radii)) / len(radii)
    x, y = np.abs(radii * np.cos(angles)), np.abs(radii * np.sin(angles))
    best = (0.0, 0.0)
    for half in x:
        within = x < half - 1e-9
        if within.any():
            best = max(best, (float(half), float(y[within].min())), key=lambda each: each[0] * each[1])
    return best


def _cast(shapes: Sequence[Planes], starts: Array, directions: Array) -> Array:
    """[m] Way (n) from starts (n, 3) along unit directions (n, 3) to the first convex shape; inf: none."""
    nearest = np.full(len(starts), np.inf)
    for normals, offsets in shapes:
        speed, gap = directions @ normals.T, offsets - starts @ normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            ways = gap / speed
        enter = np.where(speed < 0.0, ways, -np.inf).max(axis=1)
        leave = np.where(speed > 0.0, ways, np.inf).min(axis=1)
        beside = ((speed == 0.0) & (gap < 0.0)).any(axis=1)
        hit = (enter <= leave) & (leave >= 0.0) & ~beside
        nearest = np.where(hit, np.minimum(nearest, np.maximum(enter, 0.0)), nearest)
    return nearest


def _planes(geometry: Geometry) -> Planes | None:
    """A contact shape, in O, by the planes around it; None for a mesh without a hull."""
    shape, X = geometry.shape, geometry.X_LS
    normals: Array
    if isinstance(shape, Box):
        normals, offsets = np.concatenate([np.eye(3), -np.eye(3)]), np.tile(np.array(shape.size) / 2.0, 2)
    elif isinstance(shape, Cylinder):
        angles = 2.0 * math.pi * np.arange(_ROUND) / _ROUND
        normals = np.stack([np.cos(angles), np.sin(angles), np.zeros(_ROUND)], axis=1)
        normals = np.concatenate([normals, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
        offsets = np.array([*[shape.radius] * _ROUND, *[shape.length / 2.0] * 2])
    elif isinstance(shape, Sphere):
        k = np.arange(4 * _ROUND) + 0.5  # spread evenly by the golden angle
        z, turn = 1.0 - k / (2.0 * _ROUND), math.pi * (3.0 - math.sqrt(5.0)) * k
        across = np.sqrt(1.0 - z * z)
        normals, offsets = np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1), np.full(len(k), 0.0)
        offsets += shape.radius
    else:
        corners = _corners(shape)
        convex = None if corners is None else hull(corners)
        if convex is None:
            return None
        points, faces = convex[0], convex[1]
        a, b, c = (points[faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        length = np.linalg.norm(normals, axis=1)
        sound = length > 1e-15
        normals, a = normals[sound] / length[sound, None], a[sound]
        offsets = np.sum(normals * a, axis=1)
        normals, first = np.unique(np.round(np.column_stack([normals, offsets]), 7), axis=0, return_index=True)
        normals, offsets = normals[:, :3], offsets[first]
    turned = normals @ X.R.T
    return turned, offsets + turned @ X.p


def _corners(mesh: Mesh) -> Array | None:
    points = welded(read_mesh(mesh.path))[0] if mesh.part is None else np.array(mesh.part.points)
    return np.asarray(points * np.array(mesh.scale))


def _bounds(geometries: Sequence[Geometry]) -> tuple[Array, Array]:
    box = box_about(geometries)
    assert box is not None  # every mesh has been read
    return np.asarray(box[0]), np.asarray(box[1])
