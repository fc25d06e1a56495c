"""Poses of the frames of a drawing, for one state or for many at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, quat_product, rotate
from manipcli.model.batch_kinematics import forward_batch, link_places
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of the frames of a drawing in the world: `position` (..., F, 3) [m], `quat_xyzw` (..., F, 4)."""

    position: Array
    quat_xyzw: Array

    def X_WF(self, k: int) -> Transform:
        """The pose of the k-th frame, for poses of one state."""
        return Transform.of(xyz=self.position[k], quat_xyzw=self.quat_xyzw[k])


class Placing:
    """Computes the poses of all frames of `draw(robot, scene)` from joint positions and body poses."""

    def __init__(self, robot: RobotModel | None, scene: Scene | None = None) -> None:
        self._robot = robot
        self._scene = scene
        self._links = [] if robot is None else [link_places(robot)[link.name] for link in robot.links]

    @property
    def still(self) -> frozenset[str]:
        """The frames that never move: the world, fixed bodies, and links above all moving joints."""
        links = self._robot.links if self._robot is not None else ()
        bodies = self._scene.bodies if self._scene is not None else ()
        fixed = [f"robot/{link.name}" for link, (last, _) in zip(links, self._links, strict=True) if last < 0]
        return frozenset(["world", *fixed, *(body.name for body in bodies if body.fixed)])

    def start(self, q: Array | None = None) -> Poses:
        """Poses with the joints at `q` (n,) and the bodies at their start poses."""
        movable = self._scene.movable if self._scene is not None else ()
        p = np.array([body.X_WO.p for body in movable]).reshape(-1, 3)
        quat = np.array([body.X_WO.quat_xyzw for body in movable]).reshape(-1, 4)
        return self.at(np.zeros(0) if q is None else q, p, quat)

    def at(self, q: Array, body_position: Array, body_quat_xyzw: Array) -> Poses:
        """Poses at states as in `WorldState`: `q` (..., n), bodies (..., m, 3) [m] and (..., m, 4)."""
        axes = q.shape[:-1]
        count = math.prod(axes)
        bodies = self._scene.bodies if self._scene is not None else ()
        frames = 1 + len(self._links) + len(bodies)
        position, quat = np.zeros((count, frames, 3)), np.zeros((count, frames, 4))
        quat[:, 0, 3] = 1.0
        if self._robot is not None:
            p, r = forward_batch(self._robot, q.reshape(count, -1))
            for k, (last, X) in enumerate(self._links, start=1):
                if last < 0:
                    position[:, k], quat[:, k] = X.p, X.quat_xyzw
                else:
                    position[:, k] = p[:, last] + rotate(r[:, last], X.p)
                    quat[:, k] = quat_product(r[:, last], X.quat_xyzw)
        moved = 0
        for k, body in enumerate(bodies, start=1 + len(self._links)):
            if body.fixed:
                position[:, k], quat[:, k] = body.X_WO.p, body.X_WO.quat_xyzw
            else:
                position[:, k] = body_position.reshape(count, -1, 3)[:, moved]
                quat[:, k] = body_quat_xyzw.reshape(count, -1, 4)[:, moved]
                moved += 1
        return Poses(position.reshape(*axes, frames, 3), quat.reshape(*axes, frames, 4))
