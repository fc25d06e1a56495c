"""Implicit integration of stiff joint damping, which makes explicit integration unstable."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array

STIFF: Final = 0.5
"""The damping of a joint is stiff if its share per step is above this; explicit Euler is unstable from 2 on."""


def damping_share(mass: Array, damping: Array, step: float) -> Array:
    """(n) upper bounds of the share of velocity that viscous `damping` removes per step of explicit Euler.

    The row sums of |s B^1/2 M^-1 B^1/2|, whose largest bounds its eigenvalues (Gershgorin).

    Args:
        mass: (n, n) M of the joints [kg m2 or kg].
        damping: (n) B [N m s/rad or N s/m].
        step: step s [s].
    """
    root = np.sqrt(damping)
    return np.asarray(step * np.abs(root[:, None] * np.linalg.inv(mass) * root).sum(axis=1))


def implicit_damping(mass: Array, damping: Array, step: float) -> Array:
    """(n) L in (M + L) v' = (M + L - s B) v + s u, a step s of semi-implicit Euler: s B for stiff damping, else 0.

    Stiff damping acts on the velocity after the step, other damping on the velocity before it.

    Args:
        mass: (n, n) M of the joints [kg m2 or kg].
        damping: (n) B [N m s/rad or N s/m].
        step: step s [s].
    """
    return np.where(damping_share(mass, damping, step) > STIFF, step * damping, 0.0)
