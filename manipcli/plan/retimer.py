"""Time-optimal timing of a joint path, from rest to rest, with TOPP-RA (Pham and Pham, IEEE T-RO 34(3), 2018).

The path q(s) is a cubic spline through the waypoints over their chord length in joint space. With the chain rule

    q' = (dq/ds) s',    q'' = (d2q/ds2) s'^2 + (dq/ds) s''

velocity and acceleration limits bound s'^2 and s'' along the path; TOPP-RA finds the largest s'^2. Between two grid
points s'' is constant, so s(t) is a parabola there. Jerk is not part of that problem: where a jerk limit is set, s(t)
is first averaged over a sliding window, which bounds the slope of s'' and leaves the path as it is. The motion then
takes longer by the window. Where the window is a large part of the motion, smaller accelerations need a shorter
window and are quicker. The samples are then checked at the control rate, and time is stretched by what they still
exceed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import NamedTuple

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.text import listed
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.rest_to_rest import rest_to_rest
from manipcli.plan.second_order import Bounded
from manipcli.plan.timing_bound import TimingBound, kept, refuse_at_rest
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import on_ticks, refuse_endless

_GRID = 300, 500  # fewest and most grid points: 300 cost 0.12 % of time against 1000 (100: 0.7 %), at 7 ms
_FINE = 1000  # with bounds, whose values bend more between grid points: at 300, stretching costs up to 1.8 %
_PER_WAYPOINT = 4  # grid points between two waypoints, up to the most
_WINDOWS = 1.0, 2.0  # times acceleration / jerk: jumps of s'' from and to zero need one, full reversals two
_LESS = 0.3  # of the accelerations, which is tried, too, with bounds
_MUCH = 0.25  # of the time without jerk limits: a window beyond it may be too wide; at half of it, it is
_HALVINGS = 20  # of the accelerations: 2^20 is more than any useful factor
_ROUNDING = 1e-9
_STRAIGHT = 9  # waypoints of a straight path: its spline is the line itself


def retime(
    points: Array, limits: MotionLimits, *, period: float, bounds: Sequence[TimingBound] = ()
) -> JointTrajectory:
    """The fastest motion along a path within `limits` and `bounds`, one point per control tick, at rest at both ends.

    The motion without the bounds is taken if it keeps them.

    Args:
        points: (k, n) on the path; one point is a rest, two are a straight line, which `rest_to_rest` times exactly.
        limits: of the path's joints, in its order.
        period: control period [s].
        bounds: of the same joints.

    Raises:
        NotPlannable: no timing exists (the path is not smooth enough, or a bound is exceeded at rest), or the limits
            make it too long.
    """
    straight = len(points) <= 2
    if straight:
        motion = rest_to_rest(points[0], points[-1], limits, period=period)
    else:
        motion = _along(points, limits, period, ())
    if kept(bounds, motion):
        return motion
    if np.ptp(motion.positions, axis=0).max() <= _ROUNDING:
        refuse_at_rest(bounds, motion.positions[:1], np.zeros_like(motion.positions[:1]))
    bounded = _along(np.linspace(points[0], points[-1], _STRAIGHT) if straight else points, limits, period, bounds)
    if not straight:
        return bounded
    stretched = rest_to_rest(points[0], points[-1], limits, period=period, bounds=bounds)
    return min(stretched, bounded, key=lambda each: each.duration)


def _along(points: Array, limits: MotionLimits, period: float, bounds: Sequence[TimingBound]) -> JointTrajectory:
    """The motion along three or more points."""
    refuse_endless(points, limits)  # where TOPP-RA may find no timing because of rounding
    toppra = library()
    chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
    spline = toppra.SplineInterpolator(np.concatenate(([0.0], np.cumsum(chords))), points)
    count = _FINE if bounds else int(np.clip(_PER_WAYPOINT * len(points), *_GRID))
    grid = np.linspace(0.0, float(spline.path_interval[1]), count + 1)
    scheme = toppra.constraint.DiscretizationType.Interpolation
    velocity = toppra.constraint.JointVelocityConstraint(np.column_stack((-limits.velocity, limits.velocity)))

    second_order = Bounded(spline, grid, limits, bounds)

    def timed(share: float) -> Timing:
        """With this share of the accelerations."""
        most = share * limits.acceleration
        acceleration = toppra.constraint.JointAccelerationConstraint(
            np.column_stack((-most, most)), discretization_scheme=scheme
        )
        speeds: Array | None = None
        for _ in range(second_order.rounds):
            own = second_order.constraints(toppra, speeds)
            constraints = [velocity, acceleration, *own]
            solver = toppra.algorithm.TOPPRA(constraints, spline, gridpoints=grid, solver_wrapper="seidel")
            _, speeds, _ = solver.compute_parameterization(0.0, 0.0)
            if speeds is None or not np.isfinite(speeds).all():
                refuse_at_rest(bounds, spline(grid), spline(grid, 1))
                names = listed([f"`{bound.name}`" if bound.subject else bound.name for bound in bounds])
                others = f", and the bounds of the step ({names})" if bounds else ""
                raise NotPlannable(
                    f"the path has no timing within the velocity and acceleration limits{others}: it is not smooth"
                )
        assert speeds is not None
        progress, duration = _progress(grid, speeds)
        return Timing(progress, duration, float(np.max(_peaks(spline, grid, speeds) / limits.jerk)))

    def sampled(progress: Progress, length: float) -> JointTrajectory:
        def curve(times: Array) -> tuple[Array, Array, Array]:
            s, ds, dds = progress(times)
            first, second = spline(s, 1), spline(s, 2)
            return spline(s), first * ds[:, None], second * (ds * ds)[:, None] + first * dds[:, None]

        return on_ticks(curve, length, target=points[-1], limits=limits, period=period, bounds=bounds)

    fastest = timed(1.0)
    if not np.isfinite(limits.jerk).any():
        return sampled(fastest.progress, fastest.duration)
    smooth = []
    for factor in _WINDOWS:
        chosen = [_quickest(timed, fastest, factor)]
        if bounds:
            # A bound may allow little, but leave peaks of s'', whose averages exceed it: with less there are none.
            chosen.append(timed(_LESS))
        for timing in chosen:
            refuse_endless(points, limits, timing.duration + factor * timing.window, bounds)
            smooth.append(sampled(*_averaged(timing.progress, timing.duration, factor * timing.window, period)))
        if bounds:
            break  # a longer window bends the bounds more, and what it exceeds of jerk is stretched
    return min(smooth, key=lambda motion: motion.duration)


Progress = Callable[[Array], tuple[Array, Array, Array]]
"""times (k,) [s] -> s, s', s'', each (k,)."""


class Timing(NamedTuple):
    """A motion along the path that takes `duration` [s] without jerk limits.

    Averaged over `window` [s], a jump of its s'' from or to zero keeps the jerk limits.
    """

    progress: Progress
    duration: float
    window: float


def _quickest(timed: Callable[[float], Timing], fastest: Timing, factor: float) -> Timing:
    """The quickest motion after averaging over `factor` times its window.

    Candidates are the `fastest` motion and those with a half, a quarter, ... of its accelerations a. A motion takes
    T(a) + factor a / j: the first term falls with a, the second grows. Neither does while the grid points are too far
    apart for so much acceleration.
    """
    best, share = fastest, 1.0
    if factor * fastest.window <= _MUCH * fastest.duration:
        return best
    for _ in range(_HALVINGS):
        share /= 2.0
        timing = timed(share)
        longer = timing.duration + factor * timing.window - best.duration - factor * best.window
        if longer > _ROUNDING:
            break
        best = timing
    return best


def _peaks(spline: Callable[[Array, int], Array], grid: Array, speeds: Array) -> Array:
    """(n) the greatest |q''| at the grid points, from both sides."""
    first, second, squares = spline(grid, 1), spline(grid, 2), speeds**2
    rates = (0.5 * np.diff(squares) / np.diff(grid))[:, None]
    bends = second * squares[:, None]
    sides = np.abs([bends[:-1] + first[:-1] * rates, bends[1:] + first[1:] * rates])
    return np.asarray(sides.max(axis=(0, 1)))


def _progress(grid: Array, speeds: Array) -> tuple[Progress, float]:
    """s(t) with constant s'' between grid points, and its duration [s].

    Over an interval ds with speeds a and b: dt = 2 ds / (a + b), s'' = (b^2 - a^2) / (2 ds).
    """
    ds = np.diff(grid)
    speeds = np.maximum(speeds, 0.0)
    times = np.concatenate(([0.0], np.cumsum(2.0 * ds / np.maximum(speeds[:-1] + speeds[1:], _ROUNDING))))
    rates = 0.5 * np.diff(speeds**2) / ds

    def progress(t: Array) -> tuple[Array, Array, Array]:
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(ds) - 1)
        dt = t - times[k]
        s = grid[k] + dt * (speeds[k] + 0.5 * dt * rates[k])
        return np.clip(s, grid[0], grid[-1]), np.maximum(speeds[k] + dt * rates[k], 0.0), rates[k]

    return progress, float(times[-1])


def _averaged(progress: Progress, nominal: float, window: float, period: float) -> tuple[Progress, float]:
    """`progress` averaged over a sliding `window` [s]: |s'''| falls to the jump of s'' over the window; T grows by it.

    s, s', s'' are averaged alike (the average commutes with the derivative), by cumulative sums on a fine grid; before
    the start and after the end the motion rests.
    """
    half = max(1, round(window / period))
    dt = period / 2.0
    width = 2 * half
    steps = int(np.ceil(nominal / dt))
    fine = np.minimum(np.arange(steps + 1) * dt, nominal)
    s, ds, dds = progress(fine)
    dds[-1] = 0.0
    total = steps + width
    columns = []
    for values, before, after in ((s, s[0], s[-1]), (ds, 0.0, 0.0), (dds, 0.0, 0.0)):
        padded = np.concatenate((np.full(width, before), values, np.full(width, after)))
        summed = np.concatenate(([0.0], np.cumsum(padded)))
        columns.append((summed[width + 1 :] - summed[: -width - 1])[: total + 1] / (width + 1))
    at = np.arange(total + 1) * dt

    def smooth(t: Array) -> tuple[Array, Array, Array]:
        return np.interp(t, at, columns[0]), np.interp(t, at, columns[1]), np.interp(t, at, columns[2])

    return smooth, float(at[-1])


def library() -> ModuleType:
    """The toppra module, imported without matplotlib: only its plots use that, and it is half of the import time."""
    with _late("matplotlib", "matplotlib.pyplot"):
        import toppra
    library: ModuleType = toppra
    return library


@contextmanager
def _late(*names: str) -> Iterator[None]:
    """Inside this context, importing `names` gives placeholders, which import the real module at the first use."""
    absent = [name for name in names if name not in sys.modules]
    if "toppra" in sys.modules or len(absent) < len(names):
        yield
        return
    for name in absent:
        sys.modules[name] = _Late(name)
    try:
        yield
    finally:
        for name in absent:
            if isinstance(sys.modules.get(name), _Late):
                del sys.modules[name]


class _Late(ModuleType):
    """A placeholder for a module, which is imported at the first use."""

    def __getattr__(self, attribute: str) -> object:
        if attribute.startswith("__"):
            raise AttributeError(attribute)
        import importlib

        if isinstance(sys.modules.get(self.__name__), _Late):
            child = sys.modules.get(f"{self.__name__}.{attribute}")
            if child is not None:
                return child
            raise AttributeError(attribute)
        return getattr(importlib.import_module(self.__name__), attribute)
