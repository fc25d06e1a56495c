"""Rendering of triangle meshes with PyBullet's software renderer, without window or GPU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.simulate.quiet import silence

Vector = Sequence[float]


@dataclass(frozen=True, slots=True)
class View:
    """A perspective view: `eye`, `target` and `up` (3,) in the world; the frustum at its near plane; all in m."""

    eye: Vector
    target: Vector
    up: Vector
    left: float
    right: float
    bottom: float
    top: float
    near: float
    far: float


@dataclass(frozen=True, slots=True)
class Light:
    """White light from `direction` (3,), as seen from the scene; its components are shares from 0 to 1."""

    direction: Vector
    ambient: float
    diffuse: float
    specular: float


class Rasterizer:
    """Meshes in a separate PyBullet client, and their rendering."""

    def __init__(self) -> None:
        with silence():  # its banner
            import pybullet

        self._bullet = pybullet
        self._client: int = pybullet.connect(pybullet.DIRECT)

    def close(self) -> None:
        """Disconnect the client; no method may be called afterwards."""
        self._bullet.disconnect(self._client)

    def add(self, vertices: Array, faces: npt.NDArray[np.integer], normals: Array, rgba: Vector) -> int:
        """Add a mesh of `vertices` (n, 3) [m], `faces` (m, 3) and vertex `normals` (n, 3); returns its number."""
        visual = self._bullet.createVisualShape(
            self._bullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=faces.ravel().tolist(),
            normals=normals.tolist(),
            rgbaColor=list(rgba),
            specularColor=[1.0, 1.0, 1.0],
            physicsClientId=self._client,
        )
        return int(self._bullet.createMultiBody(0.0, -1, visual, physicsClientId=self._client))

    def place(self, mesh: int, position: Array, quat_xyzw: Array) -> None:
        """Put a mesh at `position` (3,) [m] in the world."""
        self._bullet.resetBasePositionAndOrientation(
            mesh, position.tolist(), quat_xyzw.tolist(), physicsClientId=self._client
        )

    def render(
        self, size: tuple[int, int], view: View, light: Light
    ) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
        """An image of `size` (width, height) [pixel].

        Returns:
            Colours (h, w, 3), depth (h, w) as in the depth buffer, and the mask of visible meshes (h, w).
        """
        width, height = size
        _, _, pixels, depth, seen = self._bullet.getCameraImage(
            width,
            height,
            self._bullet.computeViewMatrix(view.eye, view.target, view.up),
            self._bullet.computeProjectionMatrix(view.left, view.right, view.bottom, view.top, view.near, view.far),
            lightDirection=light.direction,
            lightColor=(1.0, 1.0, 1.0),
            lightAmbientCoeff=light.ambient,
            lightDiffuseCoeff=light.diffuse,
            lightSpecularCoeff=light.specular,
            shadow=0,
            renderer=self._bullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        rgb = np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[..., :3]
        return (
            rgb,
            np.asarray(depth, dtype=np.float32).reshape(height, width),
            np.asarray(seen).reshape(height, width) >= 0,
        )
