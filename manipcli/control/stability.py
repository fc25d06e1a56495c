"""Whether damping gains are stable at the control step.

A joint of reflected inertia I under the torque -kd v, held for a step h, ends at v (1 - kd h / I): above 1 the velocity
changes its sign each step, at 2 and above it grows without bound.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import Finding
from manipcli.core.geometry import Array

RINGING = 1.0
UNSTABLE = 2.0


def damping_margin(damping: npt.ArrayLike, *, step: float, inertia: npt.ArrayLike) -> Array:
    """kd h / I, shape (n): unstable from 2, ringing above 1.

    Args:
        damping: (n) N m s/rad or N s/m; the joint's own damping is not counted.
        step: [s] how long a command is held.
        inertia: (n) kg m2 or kg, the smallest that the joint has over its motion.
    """
    return np.asarray(np.asarray(damping, dtype=np.float64) * step / np.asarray(inertia, dtype=np.float64))


def damping_findings(
    joints: Sequence[str], damping: npt.ArrayLike, *, step: float, inertia: npt.ArrayLike
) -> tuple[Finding, ...]:
    """Warnings for the joints (n) whose margin is above 1, with the gain at which it would be 1."""
    inertias = np.broadcast_to(np.asarray(inertia, dtype=np.float64), (len(joints),))
    gains = np.broadcast_to(np.asarray(damping, dtype=np.float64), (len(joints),))
    findings = []
    for name, kd, mass, margin in zip(
        joints, gains, inertias, damping_margin(gains, step=step, inertia=inertias), strict=True
    ):
        if margin > RINGING:
            state = "is unstable" if margin >= UNSTABLE else "rings"
            findings.append(
                Finding(
                    code="CTRL150",
                    message=f"{name}: kd {kd:.4g} {state} at a step of {step * 1e3:.4g} ms: "
                    f"kd x step / inertia is {margin:.3g}, inertia {mass:.3g}",
                    hint=f"stay below kd {RINGING * mass / step:.3g} (unstable from {UNSTABLE * mass / step:.3g})",
                    severity="warning",
                )
            )
    return tuple(findings)
