"""The state of the world at one instant, or at many: every array may carry leading axes `...` (time).

The same conditions read a live state (no leading axis) and a whole recording (a leading time axis).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class WorldState:
    """Joint vectors follow `RobotModel.moving_joints` (n); body arrays follow `Scene.movable` (m).

    Attributes:
        time: (...) [s] of simulated time.
        position, velocity, effort: (..., n) rad or m, per second, N m or N.
        body_position: (..., m, 3) [m] of each body's frame O in the world.
        body_quat_xyzw: (..., m, 4).
        body_linear: (..., m, 3) [m/s] velocity of O (not of the centre of mass) in the world.
        body_angular: (..., m, 3) [rad/s] in the world.
        block: (..., 3 n + 7 m) where positions to quaternions are views of one array; None where they are not.
    """

    time: Array
    position: Array
    velocity: Array
    effort: Array
    body_position: Array
    body_quat_xyzw: Array
    body_linear: Array
    body_angular: Array
    block: Array | None = None

    @classmethod
    def room(cls, joints: int, bodies: int, *leading: int) -> WorldState:
        """Zeros in one `block`, which a control tick can copy at once."""
        n, m = joints, bodies
        block = np.zeros((*leading, 3 * n + 7 * m))
        poses = block[..., 3 * n :].reshape(*leading, m, 7)
        position, velocity, effort = (block[..., k * n : (k + 1) * n] for k in range(3))
        linear, angular = np.zeros((2, *leading, m, 3))
        time = np.zeros(leading)
        return cls(time, position, velocity, effort, poses[..., :3], poses[..., 3:], linear, angular, block)

    @property
    def numbers(self) -> Array:
        """(..., 3 n + 7 m) position, velocity, effort, then position and quaternion of each body; not to be written."""
        if self.block is not None:
            return self.block
        poses = np.concatenate((self.body_position, self.body_quat_xyzw), axis=-1)
        flat = poses.reshape(*poses.shape[:-2], poses.shape[-2] * 7)
        return np.concatenate((self.position, self.velocity, self.effort, flat), axis=-1)

    def map(self, change: Callable[[Array], Array]) -> WorldState:
        """The same with every array changed: `states.map(np.copy)`, `states.map(lambda a: a[-1])`."""
        return WorldState(*(change(getattr(self, name)) for name in self.__slots__ if name != "block"))


class Contact(NamedTuple):
    """Two touching parts. `a` and `b` name a body, or `robot/<link>`; sorted so that a <= b.

    `force` [N]: sum of the normal forces between the two; `distance` [m]: the deepest, negative when penetrating.
    A named tuple, because a control tick makes many, at a third of a dataclass's cost.
    """

    a: str
    b: str
    force: float
    distance: float


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Pose of a body's frame O in the world, with the leading axes of the state it came from."""

    position: Array
    quat_xyzw: Array


def body_pose(scene: Scene, state: WorldState, name: str) -> BodyPose:
    """Pose of a body by name; a fixed body's constant pose broadcasts against any state."""
    body = scene.body(name)
    if body.fixed:
        return BodyPose(position=np.asarray(body.X_WO.p), quat_xyzw=np.asarray(body.X_WO.quat_xyzw))
    k = scene.movable.index(body)
    return BodyPose(position=state.body_position[..., k, :], quat_xyzw=state.body_quat_xyzw[..., k, :])
