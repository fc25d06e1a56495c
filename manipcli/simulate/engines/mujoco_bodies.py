"""States of the bodies of a scene, read from MuJoCo's free joints.

MuJoCo's frame of a body is at its centre of mass C, with the axes of its frame O. A free joint has the position of C,
the quaternion wxyz, the velocity of C in the world, and the angular velocity in the axes of the body.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.state import WorldState
from manipcli.scene.scene import Body, Scene

Vector = tuple[float, float, float]


class BodyStates:
    """Bodies (f) with free joints that are next to each other in the model, and in a state.

    Args:
        data: `MjData`.
        bodies: in the order of the state.
        row: the row of the first one.
        at: number of its first position, and of its first velocity, in `data`.
        state: receives what is read; from `WorldState.room`.
    """

    def __init__(self, data: Any, bodies: Sequence[Body], row: int, at: tuple[int, int], state: WorldState) -> None:
        f, (q, v) = len(bodies), at
        self._poses: Array = data.qpos[q : q + 7 * f].reshape(f, 7)
        self._twists: Array = data.qvel[v : v + 6 * f].reshape(f, 6)
        self._warm: Array = data.qacc_warmstart[v : v + 6 * f].reshape(f, 6)
        self._rows = {body.name: k for k, body in enumerate(bodies)}
        self._state, self._first, self._in_state = state, row, slice(row, row + f)
        offsets: list[Vector] = [(*map(float, body.X_OI.p),) for body in bodies]  # type: ignore[misc]
        first = state.numbers.size - 7 * state.body_position.shape[-2] + 7 * row
        self._apart = [(k, first + 7 * k, offset) for k, offset in enumerate(offsets) if any(offset)]
        self._offsets = [offset if any(offset) else None for offset in offsets]
        # Single numbers are written through memory views: a row of an array takes a microsecond.
        self._numbers = _doubles(state.numbers)
        self._linear, self._angular = _doubles(state.body_linear), _doubles(state.body_angular)

    def __contains__(self, body: str) -> bool:
        return body in self._rows

    def read(self, *, velocities: bool) -> None:
        """Read the poses of the frames O, and on request their velocities."""
        state, poses, numbers, rows = self._state, self._poses, self._numbers, self._in_state
        state.body_position[rows] = poses[:, :3]
        state.body_quat_xyzw[rows, :3] = poses[:, 4:]
        state.body_quat_xyzw[rows, 3] = poses[:, 3]
        for k, at, offset in self._apart:
            px, py, pz, *quat = poses[k].tolist()
            x, y, z = _rotated(quat, offset)
            numbers[at], numbers[at + 1], numbers[at + 2] = px - x, py - y, pz - z
        if velocities:
            self._read_velocities()

    def move(self, twists: Array) -> None:
        """Give the bodies velocities (m, 6) of their frames O, linear then angular, in the world; m of the state."""
        for k, twist in enumerate(twists[self._in_state].tolist()):
            self._move(k, twist)

    def _move(self, k: int, twist: Sequence[float]) -> None:
        w, *vector = self._poses[k, 3:].tolist()
        angular = twist[3:]
        arm = _rotated([w, *vector], self._offsets[k] or (0.0, 0.0, 0.0))
        self._twists[k, :3] = np.add(twist[:3], np.cross(angular, arm))
        self._twists[k, 3:] = _rotated([w, *(-x for x in vector)], angular)

    def place(self, body: str, X_WO: Transform, twist: Array) -> None:
        """Put a body elsewhere; see `Engine.place`. The solver begins without its last acceleration."""
        k = self._rows[body]
        x, y, z, w = X_WO.quat_xyzw
        self._poses[k, 3:] = w, x, y, z
        self._poses[k, :3] = X_WO.apply(self._offsets[k] or (0.0, 0.0, 0.0))
        self._move(k, twist.tolist())
        self._warm[k] = 0.0

    def state_of(self, body: str) -> tuple[Transform, Array]:
        """See `Engine.body_state`."""
        k = self._rows[body]
        w, *vector = self._poses[k, 3:].tolist()
        arm = np.array(_rotated([w, *vector], self._offsets[k] or (0.0, 0.0, 0.0)))
        angular = np.array(_rotated([w, *vector], self._twists[k, 3:].tolist()))
        linear = self._twists[k, :3] - np.cross(angular, arm)
        X_WO = Transform.of(xyz=self._poses[k, :3] - arm, quat_xyzw=(*vector, w))
        return X_WO, np.concatenate((linear, angular))

    def _read_velocities(self) -> None:
        linear, angular, at = self._linear, self._angular, 3 * self._first
        for pose, twist, offset in zip(self._poses.tolist(), self._twists.tolist(), self._offsets, strict=True):
            quat = pose[3:]
            vx, vy, vz, *local = twist
            wx, wy, wz = _rotated(quat, local)
            if offset is not None:
                x, y, z = _rotated(quat, offset)
                vx, vy, vz = vx - wy * z + wz * y, vy - wz * x + wx * z, vz - wx * y + wy * x
            linear[at], linear[at + 1], linear[at + 2] = vx, vy, vz
            angular[at], angular[at + 1], angular[at + 2] = wx, wy, wz
            at += 3


def free_bodies(model: Any, data: Any, scene: Scene, numbers: Mapping[str, int], state: WorldState) -> list[BodyStates]:
    """The bodies of a scene with free joints, as few groups as possible: all together, unless joints are between them.

    `numbers`: MuJoCo's number of each body.
    """
    groups: list[tuple[list[Body], tuple[int, int]]] = []
    last = -1
    bodies = scene.movable[: len(scene.movable) - len(scene.joints)]  # what joints move comes last
    for body in bodies:
        joint = model.body_jntadr[numbers[body.name]]
        at = (int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]))
        if at[0] != last:
            groups.append(([], at))
        groups[-1][0].append(body)
        last = at[0] + 7
    rows = {body.name: k for k, body in enumerate(scene.movable)}
    made = [BodyStates(data, group, rows[group[0].name], at, state) for group, at in groups]
    return made or [BodyStates(data, (), 0, (0, 0), state)]


def _rotated(quat_wxyz: list[float], v: Sequence[float]) -> Vector:
    """R(quat) v; plain floats, which are faster than numpy for one vector."""
    w, x, y, z = quat_wxyz
    a, b, c = v
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx


def _doubles(array: Array) -> memoryview[float]:
    """The numbers of a contiguous array, for single assignments."""
    return cast("memoryview[float]", array.reshape(-1).data)
