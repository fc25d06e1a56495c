"""When the damping of joints is stiff for a step of time, so that explicit integration would run away with it."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array

STIFF: Final = 0.5
"""Damping of a joint is stiff where its share in a step is above this; explicit Euler runs away from 2 on."""


def damping_share(mass: Array, damping: Array, step: float) -> Array:
    """(n) bounds of the share of velocities that viscous `damping` (n) takes away in a step [s] of explicit Euler.

    The row sums of |s B^1/2 M^-1 B^1/2|, none of whose eigenvalues is above the largest (Gershgorin).

    Args:
        mass: (n, n) M of the joints [kg m2 or kg].
        damping: (n) B [N m s/rad or N s/m].
        step: s.
    """
    root = np.sqrt(damping)
    return np.asarray(step * np.abs(root[:, None] * np.linalg.inv(mass) * root).sum(axis=1))


def implicit_damping(mass: Array, damping: Array, step: float) -> Array:
    """(n) L of (M + L) v' = (M + L - s B) v + s u, a step s of semi-implicit Euler: s B where damping is stiff, else 0.

    Stiff damping so acts on the velocity after the step, the other on that before it.

    Args:
        mass: (n, n) M of the joints [kg m2 or kg].
        damping: (n) B [N m s/rad or N s/m].
        step: s.
    """
    return np.where(damping_share(mass, damping, step) > STIFF, step * damping, 0.0)
