"""Velocities of bodies from their recorded poses."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array


def body_velocities(time: Array, position: Array, quat_xyzw: Array) -> tuple[Array, Array]:
    """Central differences; one-sided at both ends, zero when there is one instant only.

        v_k = (p_{k+1} - p_{k-1}) / (t_{k+1} - t_{k-1})
        w_k = log(q_{k+1} q_{k-1}^-1) / (t_{k+1} - t_{k-1})

    The error is of second order in the period; positions are doubles, so that rounding stays near 1e-13 m/s at 1 kHz.

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
    return (position[after] - position[before]) / span, _rotation(quat_xyzw[before], quat_xyzw[after]) / span


def _rotation(start: Array, end: Array) -> Array:
    """Rotation vector (..., 3) [rad] that leads from `start` to `end`, the short way."""
    u, w = end[..., :3], end[..., 3:]
    v, s = -start[..., :3], start[..., 3:]
    vector = w * v + s * u + _cross(u, v)
    real = w * s - np.sum(u * v, axis=-1, keepdims=True)
    vector = np.where(real < 0.0, -vector, vector)
    sine = np.sqrt(np.sum(vector * vector, axis=-1, keepdims=True))
    # Towards zero, angle / sine tends to 2.
    small = sine < 1e-12
    return np.asarray(vector * np.where(small, 2.0, 2.0 * np.arctan2(sine, np.abs(real)) / np.where(small, 1.0, sine)))


def _cross(a: Array, b: Array) -> Array:
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)
