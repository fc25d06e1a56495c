"""From a continuous curve of time to a trajectory with one point at every control tick, inside its limits."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.plan.limits import MotionLimits
from manipcli.plan.trajectory import JointTrajectory

Curve = Callable[[Array], tuple[Array, Array, Array]]
"""times (k,) [s] -> position, velocity, acceleration, each (k, n)."""

_ROUNDS = 6  # each stretches by what the samples exceed; 2 suffice, the rest is for jerk across kinks


def excess(velocities: Array, accelerations: Array, limits: MotionLimits, *, period: float) -> float:
    """By which factor time must be stretched so that the samples (k, n) keep the limits; 1 or less if they do.

    Stretching time by f divides velocity by f, acceleration by f^2, jerk by f^3, hence
    f = max(|v|/v_max, sqrt(|a|/a_max), cbrt(|da/dt|/j_max)).
    """
    factor = float(np.max(np.abs(velocities) / limits.velocity))
    factor = max(factor, math.sqrt(float(np.max(np.abs(accelerations) / limits.acceleration))))
    if np.isfinite(limits.jerk).any():
        jerk = np.abs(np.diff(accelerations, axis=0)) / period
        factor = max(factor, float(np.cbrt(np.max(jerk / limits.jerk))))
    return factor


def on_ticks(
    curve: Curve,
    nominal: float,
    *,
    target: Array,
    limits: MotionLimits,
    period: float,
    duration: float | None = None,
) -> JointTrajectory:
    """Sample `curve` over [0, nominal] at every multiple of `period`, stretched to end on a tick, at rest on `target`.

    With T = k * period >= nominal, q(t) = curve(t * nominal / T), so no limit that the curve keeps is exceeded; where
    the samples exceed one, T grows until they do not. Without motion the result holds `target` for one period.

    Args:
        curve: rest-to-rest motion.
        nominal: its duration [s].
        target: (n) position at its end, taken over exactly.
        limits: what the samples must keep.
        period: control period [s].
        duration: wished duration [s]; the motion is slowed down to it.

    Raises:
        NotPlannable: `duration` is shorter than the limits allow.
    """
    wished = 1 if duration is None else _ticks(duration, period)
    stretch = 1.0
    for _ in range(_ROUNDS):
        least = max(1, _ticks(nominal * stretch, period))
        ticks = max(least, wished)
        times = np.arange(ticks + 1) * period
        scale = nominal / times[-1]
        q, v, a = curve(np.minimum(times * scale, nominal))
        v, a = v * scale, a * scale**2
        q[-1], v[-1], a[-1] = target, 0.0, 0.0
        over = excess(v, a, limits, period=period)
        if over <= 1.0 + 1e-9:
            break
        stretch = over * (1.0 + 1e-9) / scale
    if duration is not None and least > wished:
        raise NotPlannable(
            f"the motion takes at least {least * period:.3f} s within its limits; {duration:.3f} s are asked for",
            hint="ask for a longer duration, or raise the velocity and acceleration limits",
        )
    return JointTrajectory.of_arrays(
        names=limits.names, times=frozen(times), positions=frozen(q), velocities=frozen(v), accelerations=frozen(a)
    )


def _ticks(time: float, period: float) -> int:
    """The first tick not before `time`, forgiving a millionth of a period of rounding."""
    return math.ceil(time / period - 1e-6)
