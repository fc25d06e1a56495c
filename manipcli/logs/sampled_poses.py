"""Signals and poses of frames that a log samples at times of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, quat_product, rotate

LEAST_STEADY = 1e-6
"""[m], or quaternion component: a frame that moves less is fixed."""


@dataclass(slots=True)
class Samples:
    """A signal over time: times [s] and rows of numbers."""

    times: list[float]
    rows: list[Sequence[float]]

    def at(self, times: Array) -> Array:
        """(T, c) interpolated linearly; constant before the first and after the last sample."""
        known, rows = np.array(self.times), np.array(self.rows, dtype=np.float64)
        order = np.argsort(known, kind="stable")
        return np.stack([np.interp(times, known[order], column[order]) for column in rows.T], axis=1)

    def observed(self, times: Array) -> Array:
        """As `at`, with NaN before the first sample."""
        found = self.at(times)
        found[times < min(self.times)] = np.nan
        return found


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of a frame over time: `p` (T, 3) [m], `q` (T, 4) xyzw."""

    p: Array
    q: Array

    def __matmul__(self, other: Poses) -> Poses:
        return Poses(self.p + rotate(self.q, other.p), quat_product(self.q, other.q))

    def inverse(self) -> Poses:
        back = self.q * np.array([-1.0, -1.0, -1.0, 1.0])
        return Poses(-rotate(back, self.p), back)

    @property
    def steady(self) -> bool:
        """Whether the frame is fixed."""
        turned = np.minimum(np.abs(self.q - self.q[:1]), np.abs(self.q + self.q[:1]))
        return bool(np.ptp(self.p, axis=0).max() < LEAST_STEADY and turned.max() < LEAST_STEADY)


def poses_at(samples: Samples, times: Array) -> Poses:
    """Poses of rows x, y, z, qx, qy, qz, qw at these times."""
    rows = samples.at(times)
    length = np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    q = np.where(length > 0.0, rows[:, 3:] / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 0.0, 1.0])
    return Poses(rows[:, :3], q)


def root_of(frame: str, tree: Mapping[str, tuple[str, Poses]]) -> tuple[str, Poses | None]:
    """The root frame above a frame, and the pose of the frame in it; None if the frame is the root."""
    pose: Poses | None = None
    seen = {frame}
    while frame in tree:
        frame, above = tree[frame]
        pose = above if pose is None else above @ pose
        if frame in seen:
            break
        seen.add(frame)
    return frame, pose
