"""Sampling of a continuous motion to a trajectory with one point per control tick, within its limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.core.text import listed
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.timing_bound import TimingBound, kept
from manipcli.plan.trajectory import CUBIC, JointTrajectory

Curve = Callable[[Array], tuple[Array, Array, Array]]
"""times (k,) [s] -> position, velocity, acceleration, each (k, n)."""

LONGEST = 600.0
"""[s] Limit for one motion. A longer one comes from a mistyped limit, and a trajectory has a point per control tick."""
_ROUNDS = 12  # each stretches time by the excess of the samples; 2 suffice except for narrow bends and kinks


def excess(velocities: Array, accelerations: Array, limits: MotionLimits, *, period: float) -> float:
    """The factor by which time must be stretched for the samples (k, n) to keep the limits; 1 or less if they do.

    Stretching time by f divides velocity by f, acceleration by f^2, jerk by f^3, hence
    f = max(|v|/v_max, sqrt(|a|/a_max), cbrt(|da/dt|/j_max)), with the accelerations of the samples and those between.
    """
    factor = float(np.max(np.abs(velocities) / limits.velocity))
    between = np.diff(velocities, axis=0) / period
    for each in (accelerations, between):
        factor = max(factor, math.sqrt(float(np.max(np.abs(each) / limits.acceleration))))
    if np.isfinite(limits.jerk).any():
        jerk = np.abs(np.diff(accelerations, axis=0)) / period
        factor = max(factor, float(np.cbrt(np.max(jerk / limits.jerk))))
    return factor


def refuse_endless(
    positions: Array, limits: MotionLimits, duration: float = 0.0, bounds: Sequence[TimingBound] = ()
) -> None:
    """Refuse a motion from rest to rest along `positions` (k, n) that takes longer than `LONGEST`.

    For a distance d a joint needs at least d / v and 2 sqrt(d / a), and where the motion is straight cbrt(32 d / j).

    Args:
        positions: the path, by points on it; two are a straight line.
        limits: of its joints.
        duration: [s] that the motion is known to take.
        bounds: named where the limits of the joints allow a shorter motion.

    Raises:
        NotPlannable: names the slowest joint, and the limit that slows it down.
    """
    distance = np.abs(np.diff(positions, axis=0)).sum(axis=0)
    with np.errstate(over="ignore"):
        squares, cubes = distance / limits.acceleration, distance / limits.jerk
        least = np.array([distance / limits.velocity, 2.0 * np.sqrt(squares), np.cbrt(32.0 * cubes)])
    by_joints = float(least[: 3 if len(positions) == 2 else 2].max())
    if max(duration, by_joints) <= LONGEST:
        return
    if bounds and by_joints <= LONGEST:
        names = [f"`keep: {bound.name}`" for bound in bounds if bound.subject] or [bound.name for bound in bounds]
        raise NotPlannable(
            f"the motion takes more than {LONGEST:g} s because of {listed(names)}",
            hint="raise this limit, or make the motion shorter; longer motions are not planned",
        )
    which, k = np.unravel_index(int(np.argmax(least)), least.shape)
    word, joint = ("velocity", "acceleration", "jerk")[which], limits.names[k]
    raise NotPlannable(
        f"the motion takes more than {LONGEST:g} s with the {word} limit of joint '{joint}'",
        hint="raise that limit, or the step's `velocity_scaling`; longer motions are not planned",
    )


def on_ticks(
    curve: Curve,
    nominal: float,
    *,
    target: Array,
    limits: MotionLimits,
    period: float,
    bounds: Sequence[TimingBound] = (),
) -> JointTrajectory:
    """Sample `curve` over [0, nominal] at every multiple of `period`, stretched to end on a tick, at rest on `target`.

    With T = k * period >= nominal, q(t) = curve(t * nominal / T), so no limit that the curve keeps is exceeded; where
    the samples exceed one, T grows until they do not. Without motion the result holds `target` for one period.

    Args:
        curve: rest-to-rest motion.
        nominal: its duration [s].
        target: (n) position at its end, reached exactly.
        limits, bounds: what the samples must keep.
        period: control period [s].

    Raises:
        NotPlannable: the limits make the motion longer than `LONGEST`.
    """
    stretch = 1.0
    path = curve(np.linspace(0.0, nominal, 100))[0]
    for _ in range(_ROUNDS):
        refuse_endless(path, limits, nominal * stretch, bounds)
        # The first tick not before the end, with a tolerance of a millionth of a period for rounding.
        ticks = max(1, math.ceil(nominal * stretch / period - 1e-6))
        times = np.arange(ticks + 1) * period
        scale = nominal / times[-1]
        q, v, a = curve(np.minimum(times * scale, nominal))
        v, a = v * scale, a * scale**2
        q[-1], v[-1], a[-1] = target, 0.0, 0.0
        over = max([excess(v, a, limits, period=period), *(bound.stretch(q, v, a) for bound in bounds)])
        if over <= 1.0 + 1e-9:
            break
        stretch = over * (1.0 + 1e-9) / scale
    return JointTrajectory.of_arrays(
        names=limits.names, times=frozen(times), positions=frozen(q), velocities=frozen(v), accelerations=frozen(a)
    )


def resampled(points: JointTrajectory, limits: MotionLimits, period: float) -> JointTrajectory:
    """Given points as one per control tick and one at their end; accelerations where the `limits` bound them.

    Raises:
        NotPlannable: longer than `LONGEST`.
    """
    if points.duration > LONGEST:
        raise NotPlannable(f"the trajectory takes {points.duration:g} s; the limit is {LONGEST:g} s")
    ticks = max(1, int(np.ceil(points.duration / period - 1e-6)))
    times = np.append(np.arange(ticks) * period, points.duration)
    q, v, a = points.sample(times)
    smooth = bool(np.isfinite(limits.acceleration).all())
    return JointTrajectory.of_arrays(
        points.names, times, q, v if points.order >= CUBIC else None, a if smooth else None
    )


def backwards(motion: JointTrajectory) -> JointTrajectory:
    """The same motion in reverse; it must have velocities and accelerations."""
    assert motion.velocities is not None and motion.accelerations is not None
    return JointTrajectory.of_arrays(
        names=motion.names, times=motion.times, positions=frozen(motion.positions[::-1]),
        velocities=frozen(-motion.velocities[::-1]), accelerations=frozen(motion.accelerations[::-1]),
    )  # fmt: skip


def stretched(motion: JointTrajectory, bounds: Sequence[TimingBound], period: float) -> JointTrajectory:
    """The motion, slower by one factor for all of it where it exceeds a bound; with velocities and accelerations."""
    if kept(bounds, motion):
        return motion
    q, v, a = motion.positions, motion.velocities, motion.accelerations
    assert v is not None and a is not None
    factor = max(bound.stretch(q, v, a) for bound in bounds)
    times = np.arange(math.ceil(motion.duration * factor / period - 1e-6) + 1) * period
    scale = motion.duration / times[-1]
    q, v, a = motion.sample(np.minimum(times * scale, motion.duration))
    return JointTrajectory.of_arrays(motion.names, times, q, v * scale, a * scale**2)
