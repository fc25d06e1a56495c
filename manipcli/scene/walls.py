"""Walls of a hollow that is neither a box nor a cylinder: how far it reaches from its axis, by height and direction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manipcli.core.geometry import Array


@dataclass(frozen=True)
class Walls:
    """Level sections of a hollow, each a polygon with one corner in each of N equally spaced directions from x.

    Attributes:
        levels: (K) [m] heights in S, upwards: floor to rim.
        radii: (K, N) [m] from the z axis of S to the wall.
    """

    levels: tuple[float, ...]
    radii: tuple[tuple[float, ...], ...]

    @cached_property
    def _levels(self) -> Array:
        return np.array(self.levels)

    @cached_property
    def _corners(self) -> Array:
        """(K, N, 2)."""
        radii = np.array(self.radii)
        angles = 2.0 * math.pi * np.arange(radii.shape[1]) / radii.shape[1]
        return np.asarray(radii[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1))

    def section(self, z: Array) -> Array:
        """Corners (..., N, 2) [m] of the section at heights `z` (...); that of the floor below it, of the rim above."""
        where = np.interp(z, self._levels, np.arange(len(self._levels)))
        low = np.minimum(where.astype(int), len(self._levels) - 2)
        share = (where - low)[..., None, None]
        return np.asarray((1.0 - share) * self._corners[low] + share * self._corners[low + 1])

    def room(self, p_S: Array) -> Array:
        """[m] Level distance (...) of points (..., 3) to the wall; negative: outside."""
        points = np.asarray(p_S, dtype=np.float64)
        a = self.section(points[..., 2])
        side = np.roll(a, -1, axis=-2) - a
        away = points[..., None, :2] - a
        along = np.sum(away * side, axis=-1) / np.maximum(np.sum(side * side, axis=-1), 1e-18)
        nearest = np.linalg.norm(away - np.clip(along, 0.0, 1.0)[..., None] * side, axis=-1).min(axis=-1)
        count = a.shape[-2]
        sector = np.floor(np.arctan2(points[..., 1], points[..., 0]) / (2.0 * math.pi / count)).astype(int) % count
        pick = np.broadcast_to(sector[..., None, None], (*sector.shape, 1, 2))
        edge, start = (np.take_along_axis(each, pick, axis=-2)[..., 0, :] for each in (side, away))
        inside = edge[..., 0] * start[..., 1] - edge[..., 1] * start[..., 0] > 0.0
        return np.asarray(np.where(inside, nearest, -nearest))

    @property
    def widths(self) -> tuple[float, float]:
        """[m] The least and the greatest width of the rim across the axis."""
        radii = np.array(self.radii[-1])
        across = radii + np.roll(radii, len(radii) // 2)
        return float(across.min()), float(across.max())

    def reach(self, direction: Array) -> float:
        """[m] How far the rim is from the axis in a direction (2,) of S."""
        radii = np.array(self.radii[-1])
        angles = 2.0 * math.pi * np.arange(len(radii) + 1) / len(radii)
        return float(np.interp(math.atan2(direction[1], direction[0]) % (2.0 * math.pi), angles, [*radii, radii[0]]))
