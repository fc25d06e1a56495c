"""States of the bodies of a scene, read from MuJoCo's free joints.

MuJoCo's frame of a body is at its centre of mass C, with the axes of its frame O. A free joint has the position of C,
the quaternion wxyz, the velocity of C in the world, and the angular velocity in the axes of the body.
"""

from __future__ import annotations

from typing import Any

from manipcli.core.geometry import Array
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene

Vector = tuple[float, float, float]


class BodyStates:
    """The movable bodies (m) of a scene, whose free joints are the last m of the model.

    Args:
        data: `MjData`.
        scene: with the bodies.
    """

    def __init__(self, data: Any, scene: Scene) -> None:
        m = len(scene.movable)
        self._poses: Array = data.qpos[len(data.qpos) - 7 * m :].reshape(m, 7)
        self._twists: Array = data.qvel[len(data.qvel) - 6 * m :].reshape(m, 6)
        offsets: list[Vector] = [(*map(float, body.X_OI.p),) for body in scene.movable]  # type: ignore[misc]
        self._offsets = [offset if any(offset) else None for offset in offsets]
        self._apart = [(k, offset) for k, offset in enumerate(offsets) if any(offset)]

    def read(self, state: WorldState, *, velocities: bool) -> None:
        """Write poses, and on request `velocities`, of the frames O to `state`."""
        poses = self._poses
        state.body_position[:] = poses[:, :3]
        state.body_quat_xyzw[:, :3] = poses[:, 4:]
        state.body_quat_xyzw[:, 3] = poses[:, 3]
        for k, offset in self._apart:
            px, py, pz, *quat = poses[k].tolist()
            x, y, z = _rotated(quat, offset)
            state.body_position[k] = px - x, py - y, pz - z
        if velocities:
            self._read_velocities(state)

    def _read_velocities(self, state: WorldState) -> None:
        linear, angular = state.body_linear, state.body_angular
        for k, (pose, twist, offset) in enumerate(
            zip(self._poses.tolist(), self._twists.tolist(), self._offsets, strict=True)
        ):
            quat = pose[3:]
            spin = angular[k] = _rotated(quat, (twist[3], twist[4], twist[5]))
            vx, vy, vz = twist[:3]
            if offset is not None:
                (wx, wy, wz), (x, y, z) = spin, _rotated(quat, offset)
                vx, vy, vz = vx - wy * z + wz * y, vy - wz * x + wx * z, vz - wx * y + wy * x
            linear[k] = vx, vy, vz


def _rotated(quat_wxyz: list[float], v: Vector) -> Vector:
    """R(quat) v; plain floats, which are faster than numpy for one vector."""
    w, x, y, z = quat_wxyz
    a, b, c = v
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx
