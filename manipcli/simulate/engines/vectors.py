"""Vectors and quaternions (xyzw) of plain floats: for single ones, numpy costs ten times as much."""

from __future__ import annotations

from collections.abc import Sequence

Vector = tuple[float, float, float]
Quat = tuple[float, float, float, float]


def rotated(quat: Sequence[float], v: Sequence[float]) -> Vector:
    """R(quat_xyzw) v."""
    x, y, z, w = quat
    a, b, c = v
    tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx


def product(a: Sequence[float], b: Sequence[float]) -> Quat:
    """Hamilton's product: R(a b) = R(a) R(b)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def plus(a: Sequence[float], b: Sequence[float]) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Sequence[float], b: Sequence[float]) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scaled(factor: float, v: Sequence[float]) -> Vector:
    return factor * v[0], factor * v[1], factor * v[2]


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
