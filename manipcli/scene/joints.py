"""Joints of a scene: a hinge or a slide between two bodies, its position, its path and its passive forces.

Every link of a jointed thing is a body of its own, so the position of a joint follows from the poses of its two bodies.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from manipcli.core.geometry import (
    Array,
    Transform,
    cross,
    matrix_from_axis_angle,
    quat_product,
    rotate,
    rotate_inverse,
)


@dataclass(frozen=True, slots=True, eq=False)
class SceneJoint:
    """A joint between two bodies of a scene. J is the frame of the child C at position 0.

    Attributes:
        name: `cabinet/slide`: the body in the task, and the joint in its file.
        type: `continuous` is a hinge without limits.
        parent, child: names of bodies.
        X_PJ: pose of J in the parent.
        axis: (3,) unit vector in J, along or about which the child moves.
        lower, upper: [rad or m]; infinite if `continuous`.
        start: position at the start.
        damping: [N m s/rad or N s/m] of the effort -damping * velocity.
        friction: [N m or N] dry friction, the same at rest and in motion.
        stiffness, rest: [N m/rad or N/m], [rad or m] of a spring with the effort -stiffness (position - rest).
        closed: the position that counts as closed.
    """

    name: str
    type: Literal["revolute", "continuous", "prismatic"]
    parent: str
    child: str
    X_PJ: Transform
    axis: Array
    lower: float
    upper: float
    start: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    closed: float = 0.0

    @property
    def slides(self) -> bool:
        return self.type == "prismatic"

    @property
    def unit(self) -> Literal["rad", "m"]:
        return "m" if self.slides else "rad"

    @property
    def effort_unit(self) -> Literal["N m", "N"]:
        return "N" if self.slides else "N m"

    def passive_effort(self, position: float, velocity: float = 0.0) -> float:
        """[N m or N] of spring and damper, without dry friction."""
        return -self.stiffness * (position - self.rest) - self.damping * velocity

    def child_pose(self, X_WP: Transform, position: float) -> Transform:
        """X_WC for the pose of the parent and a position: X_WP X_PJ X_JC(q)."""
        if self.slides:
            moved = Transform.of(xyz=position * self.axis)
        else:
            moved = Transform.of(R=matrix_from_axis_angle(self.axis, position))
        return X_WP @ self.X_PJ @ moved

    def position(self, X_WP: Transform, X_WC: Transform) -> float:
        """The position for the poses of both bodies; see `positions`."""
        return float(self.positions(X_WP.p, X_WP.quat_xyzw, X_WC.p, X_WC.quat_xyzw))

    def positions(self, p_WP: Array, quat_WP: Array, p_WC: Array, quat_WC: Array) -> Array:
        """Positions (...) [rad or m] for the poses of parent and child; what is across the joint has no effect.

        An angle is known up to whole revolutions: it is the one nearest to the middle of the limits, and of a
        `continuous` joint the one nearest to `start`.

        Args:
            p_WP, p_WC: (..., 3) [m].
            quat_WP, quat_WC: (..., 4) xyzw.
        """
        if self.slides:
            p_PC = rotate_inverse(quat_WP, p_WC - p_WP)
            return np.asarray((p_PC - self.X_PJ.p) @ (self.X_PJ.R @ self.axis))
        conjugate = np.array([-1.0, -1.0, -1.0, 1.0])
        quat_WJ = quat_product(quat_WP, self.X_PJ.quat_xyzw)
        quat_JC = quat_product(quat_WJ * conjugate, quat_WC)
        angle = 2.0 * np.arctan2(quat_JC[..., :3] @ self.axis, quat_JC[..., 3])
        middle = self._middle
        return np.asarray(middle + np.remainder(angle - middle + math.pi, math.tau) - math.pi)

    def apart(self, position: float | Array, target: float) -> Array:
        """`position` (...) - `target` [rad or m]; of a `continuous` joint within half a revolution."""
        difference = np.asarray(position - target)
        if self.type != "continuous":
            return difference
        return np.asarray(np.remainder(difference + math.pi, math.tau) - math.pi)

    @property
    def _middle(self) -> float:
        return 0.5 * (self.lower + self.upper) if math.isfinite(self.upper - self.lower) else self.start

    def child_twist(self, X_WP: Transform, twist_P: Array, X_WC: Transform, velocity: float) -> Array:
        """(6) velocity of C and angular velocity of the child in the world, from those of the parent."""
        axis = X_WP.R @ (self.X_PJ.R @ self.axis)
        linear = twist_P[:3] + cross(twist_P[3:], X_WC.p - X_WP.p)
        if self.slides:
            return np.concatenate((linear + velocity * axis, twist_P[3:]))
        return np.concatenate((linear, twist_P[3:] + velocity * axis))

    def velocity(self, X_WP: Transform, twist_P: Array, X_WC: Transform, twist_C: Array) -> float:
        """[rad/s or m/s] of the joint, from the twists (6) of both bodies."""
        axis = X_WP.R @ (self.X_PJ.R @ self.axis)
        if self.slides:
            return float(axis @ (twist_C[:3] - twist_P[:3] - cross(twist_P[3:], X_WC.p - X_WP.p)))
        return float(axis @ (twist_C[3:] - twist_P[3:]))

    def velocities(self, quat_WP: Array, p_PC_W: Array, twist_P: Array, twist_C: Array) -> Array:
        """As `velocity`, for (...) states: `p_PC_W` (..., 3) from P to C in the world, twists (..., 6)."""
        axis = rotate(quat_WP, self.X_PJ.R @ self.axis)
        if self.slides:
            relative = twist_C[..., :3] - twist_P[..., :3] - cross(twist_P[..., 3:], p_PC_W)
        else:
            relative = twist_C[..., 3:] - twist_P[..., 3:]
        return np.asarray((axis * relative).sum(axis=-1))


def joints_of(joints: Iterable[SceneJoint], body: str) -> tuple[SceneJoint, ...]:
    """The joints of a jointed thing, by the name of its root; or the one that moves a link, by the link's name."""
    return tuple(joint for joint in joints if body in (joint.child, joint.name.rpartition("/")[0]))


def root_of(joints: Iterable[SceneJoint], body: str) -> str:
    """The root of the jointed thing that a body belongs to; the body itself if no joint moves it."""
    parents = {joint.child: joint.parent for joint in joints}
    while body in parents:
        body = parents[body]
    return body


def carried_by(joints: Iterable[SceneJoint], body: str) -> tuple[str, ...]:
    """The bodies that move with a body: the children of its joints, theirs, and so on; parents first."""
    found: list[str] = []
    for joint in joints:  # parents are before their children
        if joint.parent in (body, *found):
            found.append(joint.child)
    return tuple(found)


def things(joints: Sequence[SceneJoint]) -> tuple[tuple[str, ...], ...]:
    """The bodies of each jointed thing, its root first."""
    roots = dict.fromkeys(root_of(joints, joint.child) for joint in joints)
    return tuple((root, *carried_by(joints, root)) for root in roots)
