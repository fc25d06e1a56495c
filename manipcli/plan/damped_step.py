"""One step of Levenberg-Marquardt inside joint limits: joints that it would push out of them are held."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.linalg import _umath_linalg  # type: ignore[attr-defined, unused-ignore]

from manipcli.core.geometry import Array

# The kernel of numpy's `solve` without its checks, which cost several times as much; H is positive definite.
_solve: Any = getattr(_umath_linalg, "solve1", np.linalg.solve)


def damped_step(J: Array, error: Array, damping: float, q: Array, lower: Array, upper: Array) -> Array:
    """The step dq (m); 0 for joints that are held at their limits."""
    n = len(q)
    H = J.T @ J
    H.flat[:: n + 1] += damping
    gradient = J.T @ error
    step: Array = _solve(H, gradient)
    if not _outward(q, step, lower, upper):
        return np.asarray(step)
    held = np.zeros(n, dtype=bool)
    for _ in range(n):
        outward = ((q <= lower) & (step < 0.0)) | ((q >= upper) & (step > 0.0))
        if not outward.any():
            break
        held |= outward
        free = np.flatnonzero(~held)
        step = np.zeros(n)
        if not len(free):
            break
        step[free] = _solve(H[free[:, None], free], gradient[free])
    return np.asarray(step)


def _outward(q: Array, step: npt.NDArray[np.floating], lower: Array, upper: Array) -> bool:
    """Whether a joint at its limit would be pushed further out; for a few joints quicker than with arrays."""
    for x, dx, low, high in zip(q.tolist(), step.tolist(), lower.tolist(), upper.tolist(), strict=True):
        if (dx < 0.0 and x <= low) or (dx > 0.0 and x >= high):
            return True
    return False
