"""PyBullet's own distance query on the convex parts of a robot and a scene: an oracle for paths."""

from __future__ import annotations

from itertools import product

import numpy as np
import pybullet

from manipcli.core.geometry import Array, Transform
from manipcli.plan.planner import Planner
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.primitives import Box, Cylinder, Mesh, Shape, Sphere

STEP = 2e-3
"""[rad or m] Largest motion of a joint between two examined configurations."""


def collides(planner: Planner, pairs: frozenset[tuple[str, str]], positions: Array) -> int:
    """Number of examined configurations on `positions` (k, n) at which a pair of parts overlaps."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        robot = planner.robot
        links = {
            f"robot/{link.name}": (link.name, [(g.X_LS, _made(client, g.shape)) for g in link.collisions])
            for link in robot.links
        }
        bodies = {
            body.name: [(g.X_LS, _made(client, g.shape)) for g in body.geometries] for body in planner.scene.bodies
        }
        for body in planner.scene.bodies:
            for X_OS, part in bodies[body.name]:
                _put(client, part, body.X_WO @ X_OS)
        parts = {name: made for name, (_, made) in links.items()} | bodies
        hits = 0
        for q in _dense(positions):
            for link, made in links.values():
                X_WL = planner.kinematics.forward(q, link)
                for X_LS, part in made:
                    _put(client, part, X_WL @ X_LS)
            hits += any(
                contact[8] < 0.0
                for a, b in pairs
                for (_, i), (_, j) in product(parts[a], parts[b])
                if _near(client, i, j)
                for contact in pybullet.getClosestPoints(i, j, 0.0, physicsClientId=client)
            )
        return hits
    finally:
        pybullet.disconnect(client)


def _dense(positions: Array) -> Array:
    """Configurations at most `STEP` apart, of those given and between them."""
    walked = np.concatenate(([0.0], np.cumsum(np.max(np.abs(np.diff(positions, axis=0)), axis=1))))
    wanted = np.linspace(0.0, walked[-1], int(np.ceil(walked[-1] / STEP)) + 1)
    return np.stack([np.interp(wanted, walked, column) for column in positions.T], axis=1)


def _made(client: int, shape: Shape) -> int:
    match shape:
        case Box(size=size):
            made = pybullet.createCollisionShape(
                pybullet.GEOM_BOX, halfExtents=[s / 2 for s in size], physicsClientId=client
            )
        case Sphere(radius=radius):
            made = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
        case Cylinder(radius=radius, length=length):
            made = pybullet.createCollisionShape(
                pybullet.GEOM_CYLINDER, radius=radius, height=length, physicsClientId=client
            )
        case Mesh(path=path, scale=scale):
            mesh = read_mesh(path)
            points = (mesh.vertices[np.unique(mesh.faces)] * np.array(scale)).tolist()
            # Without triangles PyBullet makes the convex hull of the points.
            made = pybullet.createCollisionShape(pybullet.GEOM_MESH, vertices=points, physicsClientId=client)
    return int(pybullet.createMultiBody(0.0, made, physicsClientId=client))


def _put(client: int, body: int, X_WS: Transform) -> None:
    pybullet.resetBasePositionAndOrientation(body, X_WS.p.tolist(), X_WS.quat_xyzw.tolist(), physicsClientId=client)


def _near(client: int, i: int, j: int) -> bool:
    """Whether the bounding boxes meet."""
    low_i, high_i = pybullet.getAABB(i, physicsClientId=client)
    low_j, high_j = pybullet.getAABB(j, physicsClientId=client)
    return all(a <= d and c <= b for a, b, c, d in zip(low_i, high_i, low_j, high_j, strict=True))
