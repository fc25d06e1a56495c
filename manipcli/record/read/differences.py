"""Velocities of bodies from their recorded poses."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, rotation_between


def body_velocities(time: Array, position: Array, quat_xyzw: Array) -> tuple[Array, Array]:
    """Central differences; one-sided at both ends, zero for a single time.

        v_k = (p_{k+1} - p_{k-1}) / (t_{k+1} - t_{k-1})
        w_k = log(q_{k+1} q_{k-1}^-1) / (t_{k+1} - t_{k-1})

    The error is of second order in the period; rounding of double positions is about 1e-13 m/s at 1 kHz.

    Args:
        time: (T,) [s], increasing.
        position: (T, m, 3) [m] in the world.
        quat_xyzw: (T, m, 4) in the world.

    Returns:
        Linear (T, m, 3) [m/s] and angular (T, m, 3) [rad/s] velocity in the world.
    """
    T = len(time)
    if T < 2:
        return np.zeros_like(position), np.zeros_like(position)
    after = np.minimum(np.arange(T) + 1, T - 1)
    before = np.maximum(np.arange(T) - 1, 0)
    span = (time[after] - time[before])[:, None, None]
    return (position[after] - position[before]) / span, rotation_between(quat_xyzw[before], quat_xyzw[after]) / span
