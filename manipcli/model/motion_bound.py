"""Upper bounds on how far parts of the robot move between configurations: for collision checks that miss nothing.

A part is enclosed in a ball with centre c and radius r, fixed in its link. Along a straight line in joint space,
q(s) = q_0 + s dq with s in [0, 1], the link has the twist (v, w) and a point of the part at most the speed

    |x'(s)| <= |v_c(s)| + |w(s)| r,        |x''(s)| <= A = sum_ij |dq_i| |dq_j| h_max(i,j)

where h_j is the largest distance of the ball from the axis of joint j in any configuration, and i, j are the joints
that move the part (counted from the base): the second derivative of x by two revolute joints is a double cross product
with the arm from the outer axis. Hence no point moves faster than |v_c| + |w| r at the middle plus A / 2.

For two links, motion is relative: joints that move both do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.configuration import position_limits
from manipcli.model.kinematics import Kinematics

_LONGEST = 10.0  # m: travel of a prismatic joint without limits


class Mover(NamedTuple):
    """A part that moves with `joint` (1..n, Pinocchio's index), relative to what is fixed to joint `seen_from`.

    `centre` (3,) [m] and `radius` [m] of its ball are in the joint's frame; `seen_from` is 0 for the world.
    """

    joint: int
    seen_from: int
    centre: Array
    radius: float


class MotionBound:
    """Bounds of the motion of `movers`, relative to the last joint that also moves what they are seen from."""

    def __init__(self, kinematics: Kinematics, movers: Sequence[Mover]) -> None:
        model = kinematics.model
        joints = kinematics.robot.moving_joints
        n = len(joints)
        self._before = [int(model.parents[k]) - 1 for k in range(1, n + 1)]
        self._revolute = np.array([joint.type != "prismatic" for joint in joints])
        placements = [model.jointPlacements[k].homogeneous for k in range(1, n + 1)]
        self._fixed, self._sine, self._cosine, self._slide = _terms(placements, _axes_of(kinematics), self._revolute)
        self._axes = _axes_of(kinematics)
        lower, upper = position_limits(joints)
        travel = np.where(np.isfinite(lower) & np.isfinite(upper), np.maximum(np.abs(lower), np.abs(upper)), _LONGEST)
        self._travel = np.where(self._revolute, 0.0, travel)
        self._offsets = np.array([placement[:3, 3] for placement in placements])
        self._above = np.zeros((n, n), dtype=bool)  # [k, j]: joint j moves what joint k moves
        for k in range(n):
            self._above[k] = self._above[self._before[k]] if self._before[k] >= 0 else False
            self._above[k, k] = True
        # Several movers are the same ball, seen from different links.
        balls: dict[tuple[int, bytes, float], int] = {}
        keys = [(mover.joint - 1, mover.centre.tobytes(), mover.radius) for mover in movers]
        self._ball = np.array([balls.setdefault(key, len(balls)) for key in keys], dtype=np.intp)
        self._joint = np.array([joint for joint, _, _ in balls], dtype=np.intp)
        self._centre = np.array([np.frombuffer(centre) for _, centre, _ in balls]).reshape(-1, 3, 1)
        self._radius = np.array([mover.radius for mover in movers])
        seen = [self._above[m.seen_from - 1] if m.seen_from else np.zeros(n, dtype=bool) for m in movers]
        own = self._above[[mover.joint - 1 for mover in movers]] if len(movers) else np.zeros((0, n), dtype=bool)
        self._between = (own & ~np.array(seen, dtype=bool).reshape(-1, n)).astype(np.float64)  # (P, n)
        radii = np.array([radius for _, _, radius in balls])
        self.reach = self._between * self._reach(radii)[self._ball]
        """(P, n) the largest distance [m] of each mover from each axis that moves it; 1 for a prismatic joint."""
        # Joints are ordered from the base outwards along every branch: the outer one of a pair has the greater index.
        inner = np.triu((self._between * self._revolute)[:, :, None] * self.reach[:, None, :])
        self._bend = inner + np.swapaxes(np.triu(inner, 1), 1, 2)  # (P, n, n) h_max(i,j); 0 for a prismatic inner one

    def along(self, a: Array, b: Array, segments: int) -> Array:
        """`lengths` of the straight line from a to b (n), cut into equal segments: (segments, P)."""
        dq = (b - a) / segments
        size = np.abs(dq)
        middle = a + (np.arange(segments) + 0.5)[:, None] * dq
        speed = self._speed(middle, dq)
        return np.asarray(np.minimum(speed + 0.5 * ((size @ self._bend) @ size), self.reach @ size))

    def lengths(self, points: Array) -> Array:
        """(k - 1, P) no point of a mover moves further [m] on each segment of the polyline `points` (k, n).

        On a part of a segment it moves at most that share of it.
        """
        dq = np.diff(points, axis=0)
        size = np.abs(dq)
        bend = np.einsum("pki,ki->kp", size @ self._bend, size)
        return np.asarray(np.minimum(self._speed(points[:-1] + 0.5 * dq, dq) + 0.5 * bend, size @ self.reach.T))

    def _speed(self, q: Array, dq: Array) -> Array:
        """(k, P) |v_c| + |w| r at configurations q (k, n) for joint velocities dq (n) or (k, n)."""
        R, p = self._forward(q)
        z = (R @ self._axes[:, :, None])[..., 0] * dq[..., None]
        if self._revolute.all():
            v, w = _cross(p, z), z
        else:
            v = np.where(self._revolute[:, None], _cross(p, z), z)
            w = np.where(self._revolute[:, None], z, 0.0)
        v, w = self._between @ v, self._between @ w  # of the world's origin: (k, P, 3) each
        centres = ((R[:, self._joint] @ self._centre)[..., 0] + p[:, self._joint])[:, self._ball]
        at_c = v + _cross(w, centres)
        speed = np.sqrt(np.einsum("kpi,kpi->kp", at_c, at_c))
        return np.asarray(speed + self._radius * np.sqrt(np.einsum("kpi,kpi->kp", w, w)))

    def _forward(self, q: Array) -> tuple[Array, Array]:
        """Rotations (k, n, 3, 3) and positions (k, n, 3) of the joints' frames in the world at `q` (k, n)."""
        turn = np.where(self._revolute, q, 0.0)[..., None, None]
        R = self._fixed + np.sin(turn) * self._sine + np.cos(turn) * self._cosine
        p = self._offsets + np.where(self._revolute, 0.0, q)[..., None] * self._slide
        for j, before in enumerate(self._before):
            if before >= 0:
                p[:, j] = (R[:, before] @ p[:, j, :, None])[..., 0] + p[:, before]
                R[:, j] = R[:, before] @ R[:, j]
        return R, p

    def _reach(self, radii: Array) -> Array:
        """(balls, n) see `reach`; 0 for joints that do not move the ball."""
        far = np.zeros((len(radii), len(self._before)))
        # Each ball's positions so far lie in the ball of radius `ball` about `centre`, a point in the frame of `at`.
        centre, ball, at = self._centre[..., 0].copy(), np.array(radii), self._joint.copy()
        for k in range(len(self._before) - 1, -1, -1):
            there = at == k
            axis = self._axes[k]
            on_axis = (centre[there] @ axis)[:, None] * axis
            across = np.linalg.norm(centre[there] - on_axis, axis=1)
            if self._revolute[k]:
                # Rotation about the axis: the ball about the centre's foot on the axis holds every position.
                far[there, k] = across + ball[there]
                centre[there] = on_axis
                ball[there] += across
            else:
                far[there, k] = 1.0
                ball[there] += self._travel[k]
            centre[there] = centre[there] @ self._rest(k).T + self._offsets[k]
            at[there] = self._before[k]
        return far

    def _rest(self, k: int) -> Array:
        """(3, 3) orientation of joint k's frame in its parent's at zero."""
        return np.asarray(self._fixed[k] + self._cosine[k])


def _axes_of(kinematics: Kinematics) -> Array:
    """(n, 3) unit axis of each moving joint in its own frame."""
    axes = np.array([joint.axis for joint in kinematics.robot.moving_joints], dtype=np.float64).reshape(-1, 3)
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def _terms(placements: Sequence[Array], axes: Array, revolute: Array) -> tuple[Array, Array, Array, Array]:
    """R_P exp(q [a]) = fixed + sin q sine + cos q cosine (each (n, 3, 3)), and the sliding direction R_P a (n, 3)."""
    R = np.array([placement[:3, :3] for placement in placements]).reshape(-1, 3, 3)
    skew = np.zeros((len(axes), 3, 3))
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -axes[:, 2], axes[:, 1], -axes[:, 0]
    skew -= np.swapaxes(skew, 1, 2)
    outer = axes[:, :, None] * axes[:, None, :]
    slide = (R @ axes[:, :, None])[..., 0]
    return R @ outer, R @ skew, R @ (np.eye(3) - outer), slide


def _cross(a: Array, b: Array) -> Array:
    """Cross products of (..., 3); several times faster than `np.cross` for small arrays."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
