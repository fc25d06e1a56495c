"""Level of detail in time: the rows of a table that linear interpolation needs to stay near all its rows.

Rows are added where the interpolation is worst, as in the algorithm of Ramer (1972) and Douglas and Peucker (1973),
with every segment split at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.render.placing import Placing, Poses

Rows = npt.NDArray[np.intp]
POSITION = 5e-4
"""Largest distance of an interpolated frame from the sampled one [m]."""
ROTATION = np.radians(0.2)
"""Largest rotation of an interpolated frame from the sampled one [rad]."""
FIRST = 64
"""Rows per segment before the first split."""


def needed_rows(count: int, errors: Callable[[Rows, Rows], Array], *, always: Iterable[int] = ()) -> Rows:
    """Rows between which the errors are at most 1.

    Args:
        count: number of rows.
        errors: for rows that are kept, and others between them, ascending, the error (k,) at each of these others.
        always: rows that are kept in any case.

    Returns:
        Ascending; the first row and the last one are among them.
    """
    kept = np.unique([*range(0, count, FIRST), count - 1, *always]).astype(np.intp)
    others = np.setdiff1d(np.arange(count), kept)
    while len(others):
        found = errors(kept, others)
        # Not a number is not near.
        far = np.where(np.isnan(found), np.inf, found)
        segment = np.searchsorted(kept, others)
        first = np.flatnonzero(np.diff(segment, prepend=-1))
        split = np.maximum.reduceat(far, first) > 1.0
        worst = others[np.lexsort((-far, segment))[first]][split]
        others = others[np.repeat(split, np.diff(first, append=len(others)))]
        others = np.setdiff1d(others, worst, assume_unique=True)
        kept = np.union1d(kept, worst)
    return kept


def interpolated(times: Array, values: Array, kept: Rows, rows: Rows) -> Array:
    """(k, ...) values at `rows`, linear between the adjacent `kept` ones, as the page does; `values` (T, ...)."""
    before, after, share = _beside(times, kept, rows)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    start = values[before]
    # The value after a known one can be unknown.
    return np.where(share == 0.0, start, start + share * (values[after] - start))


def interpolated_quats(times: Array, quats: Array, kept: Rows, rows: Rows) -> Array:
    """As `interpolated`, for quaternions (T, ..., 4): along the shorter arc, normalized."""
    before, after, share = _beside(times, kept, rows)
    share = share.reshape(-1, *[1] * (quats.ndim - 1))
    start, end = quats[before], quats[after]
    near = np.where((start * end).sum(axis=-1, keepdims=True) < 0.0, -end, end)
    mixed = (1.0 - share) * start + share * near
    return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))


def _beside(times: Array, kept: Rows, rows: Rows) -> tuple[Rows, Rows, Array]:
    k = np.clip(np.searchsorted(kept, rows, side="right") - 1, 0, max(len(kept) - 2, 0))
    before, after = kept[k], kept[np.minimum(k + 1, len(kept) - 1)]
    length = times[after] - times[before]
    share = (times[rows] - times[before]) / np.where(length > 0.0, length, 1.0)
    return before, after, share


def pose_errors(placing: Placing, times: Array, joints: Array, bodies: Array) -> Callable[[Rows, Rows], Array]:
    """The errors of interpolated states: of the frame that is farthest from its pose, 1 at `POSITION` or `ROTATION`.

    Args:
        placing: of the robot and the scene.
        times: (T,) [s].
        joints: (T, n) joint positions.
        bodies: (T, m, 7) positions [m] and quaternions (x, y, z, w) of the movable bodies.
    """

    def errors(kept: Rows, rows: Rows) -> Array:
        recorded = placing.at(joints[rows], bodies[rows, :, :3], bodies[rows, :, 3:])
        shown = placing.at(
            interpolated(times, joints, kept, rows),
            interpolated(times, bodies[..., :3], kept, rows),
            interpolated_quats(times, bodies[..., 3:], kept, rows),
        )
        return _distances(recorded, shown)

    return errors


def _distances(one: Poses, other: Poses) -> Array:
    moved = np.linalg.norm(one.position - other.position, axis=-1)
    # The chord between unit quaternions is 2 sin(angle / 4), which the arc cosine of their product would round away.
    apart = np.minimum(
        np.linalg.norm(one.quat_xyzw - other.quat_xyzw, axis=-1),
        np.linalg.norm(one.quat_xyzw + other.quat_xyzw, axis=-1),
    )
    turned = 4.0 * np.arcsin(np.minimum(apart / 2.0, 1.0))
    return np.asarray(np.maximum(moved / POSITION, turned / ROTATION).max(axis=-1))


def value_errors(times: Array, values: Array, share: float) -> Callable[[Rows, Rows], Array]:
    """The errors of interpolated columns (T, c): 1 at a `share` of the range of the column; a value that is known in
    only one of both is infinitely far."""
    known = np.isfinite(values)
    low = np.where(known, values, np.inf).min(axis=0, initial=np.inf)
    high = np.where(known, values, -np.inf).max(axis=0, initial=-np.inf)
    tolerance = np.where(high > low, (high - low) * share, 1.0)

    def errors(kept: Rows, rows: Rows) -> Array:
        shown = interpolated(times, values, kept, rows)
        far = np.abs(shown - values[rows]) / tolerance
        both = np.isnan(shown) & np.isnan(values[rows])
        return np.asarray(np.where(both, 0.0, np.nan_to_num(far, nan=np.inf)).max(axis=1, initial=0.0))

    return errors
