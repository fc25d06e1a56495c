"""Start places of bodies with a `count`: the cells of a lattice, in layers from below, each body off its cell's middle.

A cell is larger than the body by a tenth of its size, so that no two bodies overlap; an offset of at most half of that
gap in x and y, drawn from the seed and the name, keeps columns of bodies from standing on each other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.body_shapes import BodyShape, too_big
from manipcli.scene.scene import Interior
from manipcli.shapes.primitives import Cylinder
from manipcli.spec.counted import members
from manipcli.spec.scene import BodySpec

GAP: Final = 0.1
"""Between two bodies, as a share of their size."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Place of a body: (x, y) [m] from the middle of the layers, and `lift` [m] above the lowest layer."""

    x: float
    y: float
    lift: float


class Layers:
    """The cells of all bodies with a `count`, each laid out when the first of them is asked for.

    Args:
        counted: what is written, by name.
        seed: of the offsets.
    """

    def __init__(self, counted: Mapping[str, BodySpec], seed: int) -> None:
        self._counted = counted
        self._seed = seed
        self._cells: dict[str, dict[str, Cell]] = {}
        self._full: dict[str, float] = {}

    def cell(self, name: str, owner: str, shape: BodyShape, other: str, interior: Interior | None) -> Cell | int:
        """The cell of a body with its offset; if not all fit, how many do.

        Args:
            name, owner: of the body, and as written.
            shape: of each body.
            other: the container or support.
            interior: of a container.
        """
        if owner not in self._cells:
            self._cells[owner] = self._laid(owner, shape, other, interior)
        found = self._cells[owner]
        return found[name] if len(found) == self._counted[owner].count else len(found)

    def _laid(self, owner: str, shape: BodyShape, other: str, interior: Interior | None) -> dict[str, Cell]:
        body = self._counted[owner]
        count = body.count or 0
        below = 0.0 if interior is None else self._full.get(other, 0.0)
        found = cells(shape, body.yaw, count, body.grid, interior, below=below)
        if found and interior is not None:
            self._full[other] = found[-1].lift + float(shape.size[2]) * (1.0 + GAP)
        away = offsets(shape, body.yaw, count, seed=self._seed, name=owner)
        return {
            name: replace(cell, x=cell.x + float(dx), y=cell.y + float(dy))
            for name, cell, (dx, dy) in zip(members(owner, count), found, away, strict=False)
        }


def cells(
    shape: BodyShape,
    yaw: float,
    count: int,
    grid: tuple[int, int] | None,
    interior: Interior | None,
    *,
    below: float = 0.0,
) -> tuple[Cell, ...]:
    """The first `count` cells, layer by layer; fewer if no more fit into the interior.

    Args:
        shape, yaw: of each body, upright.
        count: how many are wanted.
        grid: cells along x and along y in each layer; None: as many as fit the interior, else one layer near a square.
        interior: what the bodies are inside of; None: layers without walls.
        below: [m] height of the interior that is full already.
    """
    width = _width(shape, yaw) * (1.0 + GAP)
    height = float(shape.size[2]) * (1.0 + GAP)
    if grid is None and interior is None:
        across = math.ceil(math.sqrt(count))
        grid = (across, math.ceil(count / across))
    if interior is None:
        assert grid is not None
        layer = _grid(width, *grid)
        layers = math.ceil(count / len(layer))
    else:
        layer = _best(shape, yaw, width, interior) if grid is None else _grid(width, *grid)
        layer = [(x, y) for x, y in layer if _fits(shape, yaw, interior, x, y, width)]
        depth = interior.shape.length if isinstance(interior.shape, Cylinder) else interior.shape.size[2]
        layers = int((depth - below + height - float(shape.size[2])) / height) if layer else 0
    found = [Cell(x, y, below + k * height) for k in range(layers) for x, y in layer]
    return tuple(found[:count])


def offsets(shape: BodyShape, yaw: float, count: int, *, seed: int, name: str) -> Array:
    """(count, 2) [m] the offset of each body from the middle of its cell."""
    most = _width(shape, yaw) * GAP / 2.0
    generator = np.random.default_rng([seed, *name.encode()])
    return np.asarray(generator.uniform(-1.0, 1.0, (count, 2)) * most)


def _width(shape: BodyShape, yaw: float) -> Array:
    """(2,) [m] of the outline along x and y."""
    if shape.radius is not None:
        return np.full(2, 2.0 * shape.radius)
    c, s = abs(math.cos(yaw)), abs(math.sin(yaw))
    return np.array([c * shape.size[0] + s * shape.size[1], s * shape.size[0] + c * shape.size[1]])


def _grid(width: Array, along_x: int, along_y: int) -> list[tuple[float, float]]:
    """The middles of cells around (0, 0), the nearest first."""
    xs = (np.arange(along_x) - (along_x - 1) / 2.0) * width[0]
    ys = (np.arange(along_y) - (along_y - 1) / 2.0) * width[1]
    middles = [(float(x), float(y)) for y in ys for x in xs]
    return sorted(middles, key=lambda at: (round(math.hypot(*at), 9), at))


def _best(shape: BodyShape, yaw: float, width: Array, interior: Interior) -> list[tuple[float, float]]:
    """The grid with the most cells in the interior: with an odd or an even number of cells along each axis."""
    hollow = interior.shape
    across = np.array([2.0 * hollow.radius] * 2 if isinstance(hollow, Cylinder) else hollow.size[:2])
    most = [max(1, min(1000, int(number))) for number in across / width]
    choices = [_grid(width, x, y) for x in {most[0], max(1, most[0] - 1)} for y in {most[1], max(1, most[1] - 1)}]
    return max(choices, key=lambda grid: sum(_fits(shape, yaw, interior, x, y, width) for x, y in grid))


def _fits(shape: BodyShape, yaw: float, interior: Interior, x: float, y: float, width: Array) -> bool:
    """Whether a body anywhere in its cell at (x, y) is inside the walls."""
    reach = width * GAP / (1.0 + GAP) / 2.0
    return too_big(shape, yaw, interior, abs(x) + reach[0], abs(y) + reach[1]) <= 0.0
