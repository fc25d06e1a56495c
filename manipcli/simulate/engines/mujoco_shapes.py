"""Collision geoms of MuJoCo for the shapes of a link or a body; a mesh becomes convex hulls, as in PyBullet."""

from __future__ import annotations

from types import ModuleType
from typing import Any, Final

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Array, Transform
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Sphere

THICKNESS: Final = 2e-4
"""[m] of a flat mesh, whose hull has no volume."""


class Shapes:
    """Adds geoms to the bodies of one `MjSpec`. Equal meshes share one asset.

    Args:
        mujoco: the library.
        spec: the `MjSpec`.
    """

    def __init__(self, mujoco: ModuleType, spec: Any) -> None:
        self._kinds, self._spec = mujoco.mjtGeom, spec
        self._hulls: dict[tuple[Mesh, int], str] = {}
        self._count = 0

    def add(self, body: Any, geometry: Geometry, X_BL: Transform, **contact: Any) -> list[str]:
        """Add the geoms of a shape to `body` and return their names.

        Args:
            body: `MjsBody` with the frame B.
            geometry: a shape in L.
            X_BL: pose of L in B.
            contact: attributes of the geoms for contact.

        Raises:
            InvalidInput: a mesh file cannot be used.
        """
        X = X_BL @ geometry.X_LS
        kinds, shape = self._kinds, geometry.shape
        attributes = {"pos": X.p, "quat": wxyz(X.quat_xyzw), **contact}
        match shape:
            case Box(size):
                return [self._geom(body, type=kinds.mjGEOM_BOX, size=[s / 2 for s in size], **attributes)]
            case Sphere(radius):
                return [self._geom(body, type=kinds.mjGEOM_SPHERE, size=[radius, 0.0, 0.0], **attributes)]
            case Cylinder(radius, length):
                half = [radius, length / 2, 0.0]
                return [self._geom(body, type=kinds.mjGEOM_CYLINDER, size=half, **attributes)]
            case Mesh():
                kind = kinds.mjGEOM_MESH
                return [self._geom(body, type=kind, meshname=name, **attributes) for name in self._meshes(shape)]

    def _geom(self, body: Any, **attributes: Any) -> str:
        name = f"geom{self._count}"
        self._count += 1
        body.add_geom(name=name, **attributes)
        return name

    def _meshes(self, mesh: Mesh) -> list[str]:
        """Names of the assets of a mesh, one for each part."""
        names = []
        for k, points in enumerate(convex_parts(mesh)):
            if (mesh, k) not in self._hulls:
                name = self._hulls[mesh, k] = f"mesh{len(self._hulls)}"
                self._spec.add_mesh(name=name, uservert=points.ravel().tolist())
            names.append(self._hulls[mesh, k])
        return names


def convex_parts(mesh: Mesh) -> list[Array]:
    """Vertices (n, 3) [m] of each convex part of a mesh: of each object of an OBJ file, else of the whole mesh.

    Raises:
        InvalidInput: the mesh file cannot be used.
    """
    if mesh.part is not None:
        return [np.array(mesh.part.points) * np.array(mesh.scale)]
    try:
        triangles = read_mesh(mesh.path)
    except UnusableMesh as error:
        message = f"mesh '{mesh.uri}' {error.reason}"
        raise InvalidInput([Diagnostic("URDF200", message, hint=error.hint)]) from error
    starts = triangles.parts if triangles.format == "obj" and triangles.parts else (0,)
    ends = (*starts[1:], len(triangles.faces))
    parts = [triangles.faces[start:end] for start, end in zip(starts, ends, strict=True) if end > start]
    return [_solid(triangles.vertices[np.unique(faces)] * np.array(mesh.scale)) for faces in parts]


def _solid(points: Array) -> Array:
    """The points; if they are in a plane, copies on both sides of it, `THICKNESS` apart."""
    centred = np.zeros((max(len(points), 3), 3))
    centred[: len(points)] = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(centred, full_matrices=False)
    for axis, extent in zip(axes, spread, strict=True):
        if extent <= 1e-6 * spread[0]:
            points = np.concatenate((points - THICKNESS / 2 * axis, points + THICKNESS / 2 * axis))
    return points


def wxyz(quat_xyzw: Array) -> list[float]:
    """(4) the quaternion in the order of MuJoCo."""
    x, y, z, w = (float(v) for v in quat_xyzw)
    return [w, x, y, z]
