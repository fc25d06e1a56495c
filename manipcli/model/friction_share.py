"""Share of the friction cone that the contacts of taxels use: 1 where they slip.

A contact with the normal force N and the coefficient of friction mu carries tangential forces up to mu N (Coulomb). For
taxels with the sums N of the normal and (T_x, T_y) of the tangential forces the share is

    sqrt(T_x^2 + T_y^2) / (mu N)

It is the share of the sums: tangential forces that cancel do not add to it, as those of an object that rotates on the
taxels, or those with which two fingers strain it against each other (internal forces). Taxels of several fingers
therefore use the cone together: their tangential forces are added as vectors, in one frame.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array


def grip_forces(reading: Array) -> tuple[Array, Array]:
    """Sums of normal and of tangential forces [N], each (...), of readings of taxels with shear.

    Args:
        reading: (..., 3 n) [N] of n cells: the normal forces, then those along x, then those along y.
    """
    return joint_forces([reading], [np.eye(3)])


def joint_forces(readings: Sequence[Array], rotations: Sequence[Array]) -> tuple[Array, Array]:
    """The same for several sensors: the sum of their normal forces, and the size of the sum of their tangential ones.

    Args:
        readings: (..., 3 n) [N] of each sensor; the leading axes are the same.
        rotations: (..., 3, 3) of each sensor frame in one frame, that of the hand or the world.
    """
    normal, tangential = np.zeros(()), np.zeros(3)
    for reading, R in zip(readings, rotations, strict=True):
        sums = reading.reshape(*reading.shape[:-1], 3, reading.shape[-1] // 3).sum(axis=-1)
        normal = normal + sums[..., 0]
        tangential = tangential + (R[..., :2] @ sums[..., 1:, None])[..., 0]
    return normal, np.linalg.norm(tangential, axis=-1)


def friction_share(normal: npt.ArrayLike, tangential: npt.ArrayLike, mu: float) -> Array:
    """Share (...) of the friction cone that is used; infinite for a tangential without a normal force, 0 without both.

    Args:
        normal, tangential: (...) [N] sums, at least 0 but for noise.
        mu: coefficient of friction.
    """
    carried = mu * np.maximum(normal, 0.0)
    used = np.asarray(tangential, dtype=np.float64)
    unpressed = np.where(used > 0.0, np.inf, 0.0)
    return np.divide(used, carried, out=unpressed, where=carried > 0.0)
