"""One step of Levenberg-Marquardt inside joint limits: joints that it would push out of them are held."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

Solve = Callable[..., Any]


def solve_kernel(module: str = "numpy.linalg._umath_linalg") -> Solve:
    """The kernel of numpy's `solve` (n, n), (n) -> (n) without its checks, which are a sixth of the cost of an attempt.

    It is private to numpy: `solve` itself where it is missing, fails, or gives other bits.
    """
    H, b = np.array([[3.0, 1.0, 0.3], [1.0, 2.0, 0.1], [0.3, 0.1, 1.7]]), np.array([0.1, 0.7, -1.3])
    try:
        kernel: Solve = importlib.import_module(module).solve1
        same = kernel(H, b).tobytes() == np.linalg.solve(H, b).tobytes()
    except Exception:  # noqa: BLE001 - whatever a private function does in other versions
        return np.linalg.solve
    return kernel if same else np.linalg.solve


_solve = solve_kernel()  # of a matrix that is positive definite


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
