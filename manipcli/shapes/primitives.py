"""Geometric primitives and mesh references, placed in a frame; immutable."""

from __future__ import annotations

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


@dataclass(frozen=True, slots=True)
class Mesh:
    """A mesh file: `uri` as `package://NAME/...`, `path` of the file, `scale` per axis."""

    uri: str
    path: Path
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Shape = Box | Sphere | Cylinder | Mesh


@dataclass(frozen=True, slots=True)
class Geometry:
    """A shape at `X_LS` in the frame of a link or a body; `rgba` is used for drawing only."""

    X_LS: Transform
    shape: Shape
    rgba: Rgba | None = None
