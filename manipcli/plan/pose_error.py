"""Error of a tool pose against a goal of which part may be left open, and tolerances of a goal.

Where the rotation about an axis a (unit vector in the world) is free, the error is what remains after the best one:
with E = R_G R_T^T = T S, T the twist about a and S the swing, it is log(S), which has no part along a (Dobrowolski,
Swing-twist decomposition in Clifford algebra, 2015). For a the goal's z axis that is the smallest rotation between the
two z axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from manipcli.core.geometry import Array, Transform, cross, matrix_from_axis_angle, quat_from_matrix

Open = Literal["nothing", "spin", "yaw", "rotation"]
"""The part of the tool's orientation that a goal leaves open: nothing, the rotation about its own z axis, that about
the vertical, or all of it."""

VERTICAL: Final = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class PoseTolerance:
    """How far from a goal the tool may be.

    Attributes:
        distance: [m] between the origins.
        rotation: [rad] beside what is left open.
        open: the part of the orientation that is left open.
        axis: (3,) unit vector in the world about which the goal may be rotated; None for none.
        within: [rad] how far it may be rotated about `axis`, to both sides; pi: freely.
    """

    distance: float
    rotation: float
    open: Open = "nothing"
    axis: Array | None = None
    within: float = math.pi


Leaving = Open | PoseTolerance
"""What is left open, with the default tolerance, or both."""

RESOLUTION: Final = PoseTolerance(distance=1e-4, rotation=1e-3)
"""What an arm resolves: 0.1 mm, and 1 mrad, which is 0.1 mm at 10 cm from the tool."""


def pose_error(
    X_WG: Transform, R_WT: Array, p_WT: Array, open_: Open, about: PoseTolerance | None = None
) -> tuple[Array, Array | None, float]:
    """The error (6) in the world without what is left open, its free axis (3,), and its angle [rad].

    Args:
        X_WG: the goal.
        R_WT, p_WT: the tool.
        open_: what is left open.
        about: with the axis that is free within bounds, if `open_` is "nothing".

    Returns:
        The axis is None where no rotation about an axis is free, or where it is at its bound.
    """
    error = np.zeros(6)
    error[:3] = X_WG.p - p_WT
    free: Array | None = None
    if open_ == "spin":
        free = X_WG.R[:, 2]
        error[3:] = rotation_vector(pointed(R_WT, free) @ R_WT.T)
    elif open_ != "rotation":
        E = X_WG.R @ R_WT.T
        axis, within = (VERTICAL, math.pi) if open_ == "yaw" else (None, 0.0)
        if about is not None and about.axis is not None and axis is None:
            axis, within = about.axis, about.within
        if axis is not None:
            twisted = twist(E, axis)
            free = axis if abs(twisted) < within or within >= math.pi else None
            E = matrix_from_axis_angle(axis, -min(max(twisted, -within), within)) @ E
        error[3:] = rotation_vector(E)
    x, y, z = error.tolist()[3:]
    return error, free, math.sqrt(x * x + y * y + z * z)


def twist(R: Array, axis: Array) -> float:
    """The angle in [-pi, pi] [rad] of the part of a rotation (3, 3) that is about a unit `axis` (3,)."""
    quat = quat_from_matrix(R)
    return 2.0 * math.atan2(float(quat[:3] @ axis), float(quat[3]))


def pointed(R: Array, z: Array) -> Array:
    """R (3, 3) after the smallest rotation that aligns its z axis with the unit vector `z` (3,)."""
    axis, cosine = cross(R[:, 2], z), float(R[:, 2] @ z)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return R if cosine > 0.0 else np.column_stack([R[:, 0], -R[:, 1], -R[:, 2]])
    return np.asarray(matrix_from_axis_angle(axis / sine, math.atan2(sine, cosine)) @ R)


def rotation_vector(R: Array) -> Array:
    """log(R) (3,): axis times angle in [0, pi], of a rotation matrix (3, 3)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()  # floats of Python: one by one they cost less than numpy's
    x, y, z = zy - yz, xz - zx, yx - xy
    sine = 0.5 * math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(sine, 0.5 * (xx + yy + zz - 1.0))
    if sine > 1e-7:
        scale = 0.5 * angle / sine
        return np.array([x * scale, y * scale, z * scale])
    if angle < 1.0:
        return np.array([x, y, z]) * 0.5
    # Near pi the antisymmetric part vanishes; the axis is the largest column of R + I = 2 a a^T, normalised.
    columns = R + np.eye(3)
    axis = columns[:, int(np.argmax(np.diag(columns)))]
    return np.asarray(axis / np.linalg.norm(axis) * angle)


def forgive(error: Array, J: Array, tolerance: float) -> float:
    """Take a `tolerance` off an error (3), in place, and return its new size.

    Only its size counts then: J (3, m) becomes the part along it, or 0 where nothing is left.
    """
    size = float(np.linalg.norm(error))
    if size <= tolerance:
        error[:], J[:] = 0.0, 0.0
        return 0.0
    along = error / size
    error *= 1.0 - tolerance / size
    J[:] = np.outer(along, along @ J)
    return size - tolerance
