"""Geometric primitives and mesh references, placed in a frame; immutable."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.geometry import Transform

Rgba = tuple[float, float, float, float]
"""A colour: red, green, blue and opacity, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Box:
    """Centred at its frame; `size` (3,) [m]: full edge lengths along x, y, z."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Sphere:
    """`radius` [m], centred at its frame."""

    radius: float


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Axis along z, centred at its frame; `radius` and `length` [m]."""

    radius: float
    length: float


Point = tuple[float, float, float]
Triangle = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class ConvexPart:
    """A convex part of a mesh, number `index` of its parts: corners [m / scale] and triangles, which face outwards."""

    index: int
    points: tuple[Point, ...]
    triangles: tuple[Triangle, ...]


@dataclass(frozen=True, slots=True)
class Mesh:
    """A mesh file: `uri` as `package://NAME/...`, `path` of the file, `scale` per axis.

    For contact it counts as its convex hull. With a `part`, only as that part of it; the file is then only drawn.
    """

    uri: str
    path: Path
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    part: ConvexPart | None = None


Shape = Box | Sphere | Cylinder | Mesh


@dataclass(frozen=True, slots=True)
class Geometry:
    """A shape at `X_LS` in the frame of a link or a body; `rgba` is used for drawing only."""

    X_LS: Transform
    shape: Shape
    rgba: Rgba | None = None


def mesh_files(geometries: Iterable[Geometry]) -> dict[str, Path]:
    """The files of their meshes by URI, sorted."""
    found = {each.shape.uri: each.shape.path for each in geometries if isinstance(each.shape, Mesh)}
    return dict(sorted(found.items()))


def drawn_once(geometries: tuple[Geometry, ...]) -> tuple[Geometry, ...]:
    """The geometries without the second and later parts of a mesh, whose file the first part shows."""
    return tuple(
        each
        for each in geometries
        if not isinstance(each.shape, Mesh) or each.shape.part is None or not each.shape.part.index
    )
