"""The state of the world at one or many instants: arrays may have leading axes `...` (time).

Conditions read both a live state (without leading axis) and a recording (with a leading time axis).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.joints import SceneJoint
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
        block: (..., 3 n + 7 m) the array that positions to quaternions are views of; None if they are not views.
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
        """Zeros in one `block`, which can be copied at once per control tick."""
        n, m = joints, bodies
        block = np.zeros((*leading, 3 * n + 7 * m))
        poses = block[..., 3 * n :].reshape(*leading, m, 7)
        position, velocity, effort = (block[..., k * n : (k + 1) * n] for k in range(3))
        linear, angular = np.zeros((2, *leading, m, 3))
        time = np.zeros(leading)
        return cls(time, position, velocity, effort, poses[..., :3], poses[..., 3:], linear, angular, block)

    @property
    def numbers(self) -> Array:
        """(..., 3 n + 7 m) position, velocity, effort, then position and quaternion of each body; do not modify."""
        if self.block is not None:
            return self.block
        poses = np.concatenate((self.body_position, self.body_quat_xyzw), axis=-1)
        flat = poses.reshape(*poses.shape[:-2], poses.shape[-2] * 7)
        return np.concatenate((self.position, self.velocity, self.effort, flat), axis=-1)

    def map(self, change: Callable[[Array], Array]) -> WorldState:
        """The state with a function applied to every array: `states.map(np.copy)`, `states.map(lambda a: a[-1])`."""
        return WorldState(*(change(getattr(self, name)) for name in self.__slots__ if name != "block"))


class ContactPoint(NamedTuple):
    """One point at which two parts touch; all vectors in the world.

    Attributes:
        position: (3,) [m].
        normal: (3,) unit vector out of `b` towards `a`: the normal force on `a` is `force * normal`.
        force: normal force [N].
        friction: (3,) [N] friction force on `a`.
    """

    position: tuple[float, float, float]
    normal: tuple[float, float, float]
    force: float
    friction: tuple[float, float, float]


class Contact(NamedTuple):
    """Two touching parts. `a` and `b` are a body or `robot/<link>`, with a <= b.

    `force` [N]: sum of the normal forces between the two; `distance` [m]: the deepest, negative for penetration.
    `points`: where they touch, as the physics computed them; empty in logs without points.
    A named tuple, because many are created per control tick and a dataclass takes three times as long.
    """

    a: str
    b: str
    force: float
    distance: float
    points: tuple[ContactPoint, ...] = ()


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


def joint_positions(scene: Scene, state: WorldState, joint: SceneJoint) -> Array:
    """(...) positions [rad or m] of a joint of the scene, from the poses of its two bodies."""
    X_WP, X_WC = (body_pose(scene, state, name) for name in (joint.parent, joint.child))
    found = joint.positions(X_WP.position, X_WP.quat_xyzw, X_WC.position, X_WC.quat_xyzw)
    return np.asarray(np.broadcast_to(found, np.shape(state.time)))
