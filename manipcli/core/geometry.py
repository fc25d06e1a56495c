"""Rigid transforms and quaternions in numpy, single or batched.

Monogram notation: `X_AB` is the pose of frame B in frame A, so that adjacent letters cancel in a product:
`X_AC = X_AB @ X_BC`. Quaternions are `quat_xyzw`, unit, real part last.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def frozen(values: npt.ArrayLike) -> Array:
    """A read-only float64 copy of `values`."""
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


def quat_from_matrix(R: npt.ArrayLike) -> Array:
    """Unit quaternion (4,) xyzw of a rotation matrix (3, 3); Shepperd's method, w >= 0."""
    m = np.asarray(R, dtype=np.float64)
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    candidates = np.array([m[0, 0], m[1, 1], m[2, 2], trace])
    k = int(np.argmax(candidates))
    q = np.empty(4)
    if k == 3:
        q[:] = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1.0 + trace)
    else:
        i, j, k = k, (k + 1) % 3, (k + 2) % 3
        q[i] = 1.0 + m[i, i] - m[j, j] - m[k, k]
        q[j] = m[j, i] + m[i, j]
        q[k] = m[k, i] + m[i, k]
        q[3] = m[k, j] - m[j, k]
    q /= np.linalg.norm(q)
    return q if q[3] >= 0.0 else -q


def matrix_from_quat(quat_xyzw: npt.ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4) xyzw."""
    q = np.asarray(quat_xyzw, dtype=np.float64)
    x, y, z, w = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    R = np.empty((*q.shape[:-1], 3, 3))
    R[..., 0, 0] = 1 - 2 * (y * y + z * z)
    R[..., 0, 1] = 2 * (x * y - z * w)
    R[..., 0, 2] = 2 * (x * z + y * w)
    R[..., 1, 0] = 2 * (x * y + z * w)
    R[..., 1, 1] = 1 - 2 * (x * x + z * z)
    R[..., 1, 2] = 2 * (y * z - x * w)
    R[..., 2, 0] = 2 * (x * z - y * w)
    R[..., 2, 1] = 2 * (y * z + x * w)
    R[..., 2, 2] = 1 - 2 * (x * x + y * y)
    return R


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def cross(a: Array, b: Array) -> Array:
    """`a x b` for (..., 3), broadcast; for single vectors several times as fast as `np.cross`."""
    return np.asarray(a.take(_NEXT, axis=-1) * b.take(_LAST, axis=-1) - a.take(_LAST, axis=-1) * b.take(_NEXT, axis=-1))


def rotate(quat_xyzw: npt.ArrayLike, vector: npt.ArrayLike) -> Array:
    """`R(q) v` for (..., 4) and (..., 3), broadcast: v + 2w(u x v) + 2u x (u x v)."""
    q = np.asarray(quat_xyzw, dtype=np.float64)
    v = np.asarray(vector, dtype=np.float64)
    u = q[..., :3]
    t = 2.0 * cross(u, v)
    return np.asarray(v + q[..., 3:4] * t + cross(u, t))


def rotate_inverse(quat_xyzw: npt.ArrayLike, vector: npt.ArrayLike) -> Array:
    """`R(q)^T v` for (..., 4) and (..., 3), broadcast."""
    q = np.array(quat_xyzw, dtype=np.float64)
    q[..., :3] *= -1.0
    return rotate(q, vector)


def quat_product(a: npt.ArrayLike, b: npt.ArrayLike) -> Array:
    """Hamilton's product `a b` of quaternions (..., 4) xyzw, broadcast: R(a b) = R(a) R(b)."""
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    ax, ay, az, aw = left[..., 0], left[..., 1], left[..., 2], left[..., 3]
    bx, by, bz, bw = right[..., 0], right[..., 1], right[..., 2], right[..., 3]
    out = np.empty(np.broadcast_shapes(left.shape, right.shape))
    out[..., 0] = aw * bx + ax * bw + ay * bz - az * by
    out[..., 1] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 2] = aw * bz + ax * by - ay * bx + az * bw
    out[..., 3] = aw * bw - ax * bx - ay * by - az * bz
    return out


def rotation_between(start: Array, end: Array) -> Array:
    """Shortest rotation vectors (..., 3) [rad] from `start` to `end` (..., 4) xyzw, in the frame in which both are
    given."""
    rotation = quat_product(end, start * np.array([-1.0, -1.0, -1.0, 1.0]))
    rotation = np.where(rotation[..., 3:] < 0.0, -rotation, rotation)
    sine = np.linalg.norm(rotation[..., :3], axis=-1, keepdims=True)
    small = sine < 1e-12  # towards zero, angle / sine tends to 2
    angle = 2.0 * np.arctan2(sine, rotation[..., 3:])
    return np.asarray(rotation[..., :3] * np.where(small, 2.0, angle / np.where(small, 1.0, sine)))


def wrapped(angle: Array) -> Array:
    """The same angles, wrapped to [-pi, pi) [rad]."""
    return np.asarray(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


def matrix_from_axis_angle(axis: npt.ArrayLike, angle: float) -> Array:
    """Rotation by `angle` [rad] about a unit `axis` (3,): Rodrigues' formula."""
    x, y, z = np.asarray(axis, dtype=np.float64)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K))


def matrix_from_rpy(rpy: npt.ArrayLike) -> Array:
    """URDF's fixed-axis roll, pitch, yaw [rad]: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    r, p, y = (float(v) for v in np.asarray(rpy, dtype=np.float64))
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    return (
        np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        + 0.0
    )  # zero angles give the identity without -0.0


def rpy_from_matrix(R: npt.ArrayLike) -> Array:
    """Roll, pitch, yaw (3,) [rad] of a rotation matrix; yaw is 0 at the pitch singularity."""
    m = np.asarray(R, dtype=np.float64)
    cp = math.hypot(m[0, 0], m[1, 0])
    if cp < 1e-9:
        return np.array([math.atan2(-m[1, 2], m[1, 1]), math.atan2(-m[2, 0], cp), 0.0])
    return np.array([math.atan2(m[2, 1], m[2, 2]), math.atan2(-m[2, 0], cp), math.atan2(m[1, 0], m[0, 0])])


@dataclass(frozen=True, eq=False)
class Transform:
    """A rigid transform `X_AB`: rotation `R` (3, 3) and translation `p` (3,) [m]."""

    R: Array
    p: Array

    @staticmethod
    def identity() -> Transform:
        return Transform(R=frozen(np.eye(3)), p=frozen(np.zeros(3)))

    @staticmethod
    def of(
        *,
        xyz: npt.ArrayLike = (0.0, 0.0, 0.0),
        rpy: npt.ArrayLike | None = None,
        quat_xyzw: npt.ArrayLike | None = None,
        R: npt.ArrayLike | None = None,
    ) -> Transform:
        """From a translation [m] and at most one of `rpy` [rad], `quat_xyzw`, `R`.

        `rpy` is stored as given, so that writing and reading it gives the same matrix bit for bit. -0.0 becomes 0.0.
        """
        p = frozen(np.asarray(xyz, dtype=np.float64) + 0.0)
        if R is None and quat_xyzw is None and rpy is not None:
            angles = frozen(np.asarray(rpy, dtype=np.float64) + 0.0)
            made = Transform(R=frozen(matrix_from_rpy(angles)), p=p)
            made.__dict__["rpy"] = angles
            return made
        if R is None:
            if quat_xyzw is not None:
                q = np.asarray(quat_xyzw, dtype=np.float64)
                R = matrix_from_quat(q / np.linalg.norm(q))
            else:
                R = np.eye(3)
        return Transform(R=frozen(R), p=p)

    def __matmul__(self, other: Transform) -> Transform:
        return Transform(R=frozen(self.R @ other.R), p=frozen(self.R @ other.p + self.p))

    def inverse(self) -> Transform:
        return Transform(R=frozen(self.R.T), p=frozen(-self.R.T @ self.p))

    def apply(self, points: npt.ArrayLike) -> Array:
        """Points (..., 3) given in B, expressed in A."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ self.R.T + self.p)

    @cached_property
    def quat_xyzw(self) -> Array:
        return frozen(quat_from_matrix(self.R))

    @cached_property
    def rpy(self) -> Array:
        """Roll, pitch, yaw [rad], as given or computed from `R`."""
        return frozen(rpy_from_matrix(self.R))

    @property
    def by_angles(self) -> Transform:
        """The same transform, up to rounding, with `R` rebuilt from `rpy`: for output as angles."""
        return Transform.of(xyz=self.p, rpy=self.rpy)

    @cached_property
    def matrix(self) -> Array:
        """Homogeneous matrix (4, 4)."""
        M = np.eye(4)
        M[:3, :3], M[:3, 3] = self.R, self.p
        return frozen(M)
