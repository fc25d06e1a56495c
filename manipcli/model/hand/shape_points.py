"""Points on the shapes of links, to measure hands and arms without exact geometry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Link
from manipcli.model.kinematics import Kinematics
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Shape, Sphere

MOST: Final = 600
"""Points kept of one shape."""
AROUND: Final = 16
"""Points around a cylinder or a sphere."""


class ShapePoints:
    """Points of the links of a robot: of their collision shapes, else of their visual ones."""

    def __init__(self, kinematics: Kinematics) -> None:
        self._kinematics = kinematics
        self._points: dict[str, Array] = {}

    def of(self, link: str) -> Array:
        """(k, 3) [m] in the frame of the link; (0, 3) for a link without readable shapes."""
        if link not in self._points:
            self._points[link] = _link_points(self._kinematics.robot.link(link))
        return self._points[link]

    def at(self, q: Array, links: Iterable[str], X_FW: Transform | None = None) -> Array:
        """(k, 3) [m] points of several links at `q` (n), in the world or in frame F."""
        X = Transform.identity() if X_FW is None else X_FW
        found = [
            X.apply(self._kinematics.forward(q, link).apply(self.of(link))) for link in links if len(self.of(link))
        ]
        return np.vstack(found) if found else np.zeros((0, 3))

    def missing(self, links: Iterable[str]) -> tuple[str, ...]:
        """Those of the links that have no points."""
        return tuple(link for link in links if not len(self.of(link)))


def _link_points(link: Link) -> Array:
    for shapes in (link.collisions, link.visuals):
        found = [points for shape in shapes if len(points := _geometry_points(shape))]
        if found:
            return np.vstack(found)
    return np.zeros((0, 3))


def _geometry_points(geometry: Geometry) -> Array:
    return geometry.X_LS.apply(_points(geometry.shape))


def _points(shape: Shape) -> Array:
    match shape:
        case Box(size=size):
            return np.asarray(np.array(np.meshgrid(*[(-edge / 2, 0.0, edge / 2) for edge in size])).reshape(3, -1).T)
        case Sphere(radius=radius):
            return radius * _sphere()
        case Cylinder(radius=radius, length=length):
            turn = np.linspace(0.0, 2 * np.pi, AROUND, endpoint=False)
            ring = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(AROUND)])
            return np.asarray(np.vstack([ring + np.array([0.0, 0.0, z]) for z in (-length / 2, 0.0, length / 2)]))
        case Mesh(part=part, scale=scale) if part is not None:
            return np.asarray(np.array(part.points) * np.array(scale))
        case Mesh(path=path, scale=scale):
            try:
                mesh = read_mesh(path)
            except UnusableMesh:
                return np.zeros((0, 3))
            return _thinned(mesh.vertices[np.unique(mesh.faces)] * np.array(scale))


def _sphere() -> Array:
    steps: Sequence[float] = (-1.0, 0.0, 1.0)
    grid = np.array(np.meshgrid(steps, steps, steps)).reshape(3, -1).T
    grid = grid[np.linalg.norm(grid, axis=1) > 0.5]
    return np.asarray(grid / np.linalg.norm(grid, axis=1)[:, None])


def _thinned(points: Array) -> Array:
    """At most about `MOST` points, the extreme ones among them."""
    if len(points) <= MOST:
        return points
    extreme = {int(k) for direction in _sphere() for k in (np.argmax(points @ direction),)}
    even = range(0, len(points), len(points) // MOST + 1)
    return points[sorted(extreme | set(even))]
