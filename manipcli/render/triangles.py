"""The triangles of many surfaces in arrays, as kernels take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.render.surface import Surface

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """Triangles of surfaces, one surface after the other, each in its own frame.

    Attributes:
        vertices: (v, 3) [m].
        normals: (v, 3) outward unit vectors.
        faces: (f, 3) indices of vertices.
        first_vertex, first_face: (s + 1) where each surface begins, and the end.
        centre, radius: (s, 3) and (s) of a ball around each surface [m].
    """

    vertices: Array
    normals: Array
    faces: Indices
    first_vertex: Indices
    first_face: Indices
    centre: Array
    radius: Array

    @classmethod
    def of(cls, surfaces: Sequence[Surface]) -> Triangles:
        """Those of these surfaces, none of which is empty."""
        first_vertex = _firsts([len(each.vertices) for each in surfaces])
        none = np.zeros((0, 3))
        faces = [each.faces + first for each, first in zip(surfaces, first_vertex, strict=False)]
        lows = np.array([each.vertices.min(axis=0) for each in surfaces]).reshape(-1, 3)
        highs = np.array([each.vertices.max(axis=0) for each in surfaces]).reshape(-1, 3)
        centre = (lows + highs) / 2.0
        radius = [np.linalg.norm(each.vertices - c, axis=1).max() for each, c in zip(surfaces, centre, strict=True)]
        return cls(
            vertices=np.concatenate([none, *(each.vertices for each in surfaces)]),
            normals=np.concatenate([none, *(each.normals for each in surfaces)]),
            faces=np.concatenate([none, *faces]).astype(np.int64),
            first_vertex=first_vertex,
            first_face=_firsts([len(each.faces) for each in surfaces]),
            centre=centre,
            radius=np.array(radius, dtype=np.float64),
        )

    def balls(self, rotation: Array, position: Array) -> tuple[Array, Array]:
        """Centres (s, 3) and radii (s) of the balls, with the frames of the surfaces at these poses."""
        return np.einsum("sij,sj->si", rotation, self.centre) + position, self.radius


def _firsts(counts: list[int]) -> Indices:
    return np.cumsum([0, *counts], dtype=np.int64)
