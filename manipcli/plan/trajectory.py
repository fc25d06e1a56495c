"""Joint trajectories: points in time, and what lies between them.

Between two points the curve is linear, cubic or quintic by what *both* ends give: positions; positions and velocities;
positions, velocities and accelerations. A planned trajectory is this same type with a point at every control tick, so
that sampling at ticks returns the planned values themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, frozen

Samples = tuple[Array, Array, Array]
"""Position, velocity, acceleration; each (n), or (T, n)."""

LINEAR, CUBIC, QUINTIC = 0, 1, 2

SINGULAR = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration"}


class Waypoint(Protocol):
    """What a point of a trajectory has: trajectory_msgs/JointTrajectoryPoint. Not given is None or empty."""

    @property
    def positions(self) -> Sequence[float] | Array: ...
    @property
    def velocities(self) -> Sequence[float] | Array | None: ...
    @property
    def accelerations(self) -> Sequence[float] | Array | None: ...
    @property
    def time_from_start(self) -> float: ...


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryPoint:
    """One point: `positions` (n) rad or m, its derivatives where given, `time_from_start` [s]."""

    positions: Sequence[float] | Array
    time_from_start: float = 0.0
    velocities: Sequence[float] | Array | None = None
    accelerations: Sequence[float] | Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class JointTrajectory:
    """`names` (n); `times` (k,) [s] strictly increasing from the start of the goal; arrays (k, n), or None.

    Attributes:
        orders: (k,) what each point gives: 0 positions, 1 velocities too, 2 accelerations too. None: what the arrays
            say, the same for all points. A value that a point does not give is 0 in its array and is not used.

    Raises:
        InvalidArgument: no name, no point, a repeated name, a wrong shape, NaN or infinity, a negative first time,
            times that do not increase, accelerations without velocities.
    """

    names: tuple[str, ...]
    times: Array
    positions: Array
    velocities: Array | None = None
    accelerations: Array | None = None
    orders: npt.NDArray[np.int8] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        for field in ("times", "positions", "velocities", "accelerations"):
            value = getattr(self, field)
            if value is not None:
                # A view, so that a planned trajectory of many points is not copied; read-only to whom we hand it.
                view = np.asarray(value, dtype=np.float64).view()
                view.flags.writeable = False
                object.__setattr__(self, field, view)
        _validate(self)

    @classmethod
    def from_points(
        cls, names: Sequence[str], points: Sequence[Waypoint], start: Waypoint | None = None
    ) -> JointTrajectory:
        """A trajectory of single points, as ROS writes them.

        Args:
            names: (n) joints, in the order of every point's arrays.
            points: each with `positions` and, if it likes, `velocities`, `accelerations` (None or empty: not given).
            start: where the joints are at its own `time_from_start`; leads in to the first point. Velocities and
                accelerations that it lacks and the first point has count as 0. Unused when the first point's time is
                not later: the reference then steps to that point.

        Raises:
            InvalidArgument: as the constructor, and for a point without positions or of a wrong length.
        """
        n = len(names)
        if not points:
            raise InvalidArgument("TRAJ101", "the trajectory has no points; expected at least one")
        rows = [_row(point, n, f"point {k}") for k, point in enumerate(points)]
        if start is not None and start.time_from_start < points[0].time_from_start:
            p, v, a, order, time = _row(start, n, "the start state")
            rows.insert(0, (p, v, a, max(order, rows[0][3]), time))
        orders = np.array([row[3] for row in rows], dtype=np.int8)
        highest = int(orders.max())
        return cls(
            names=tuple(names),
            times=frozen([row[4] for row in rows]),
            positions=frozen([row[0] for row in rows]),
            velocities=frozen([row[1] for row in rows]) if highest >= CUBIC else None,
            accelerations=frozen([row[2] for row in rows]) if highest == QUINTIC else None,
            orders=None if bool((orders == highest).all()) else orders,
        )

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    @property
    def order(self) -> int:
        """The highest of what the points give: 0 positions, 1 velocities too, 2 accelerations too."""
        if self.velocities is None:
            return LINEAR
        return CUBIC if self.accelerations is None else QUINTIC

    def sample(self, time: float | npt.ArrayLike) -> Samples:
        """Position, velocity and acceleration at `time` [s] from the start of the goal.

        With T the length of a segment, t the time since its first point, D the way between its points:
        linear: p0 + D t / T. Cubic: c2 = (3 D - (2 v0 + v1) T) / T^2, c3 = (-2 D + (v0 + v1) T) / T^3.
        Quintic: c2 = a0 / 2, c3 = (20 D - (8 v1 + 12 v0) T - (3 a0 - a1) T^2) / (2 T^3),
        c4 = (-30 D + (14 v1 + 16 v0) T + (3 a0 - 2 a1) T^2) / (2 T^4),
        c5 = (12 D - 6 (v1 + v0) T + (a1 - a0) T^2) / (2 T^5).

        At the time of a point its own values come back bit by bit, and where two segments meet the later one answers
        for what the point does not give. After the last point: its position, at rest.

        Args:
            time: a number, or (T,).

        Returns:
            Three arrays (n), or (T, n): rad or m, per second, per second squared.

        Raises:
            InvalidArgument: a time that is NaN or before the first point (there is nothing to know there).
        """
        t = np.asarray(time, dtype=np.float64)
        flat = np.atleast_1d(t)
        if not bool((flat >= self.times[0]).all()):
            raise InvalidArgument(
                "TRAJ110",
                f"cannot sample at {float(flat.min()):.6g} s: the trajectory begins at {float(self.times[0]):.6g} s",
            )
        samples = self._sample(flat)
        return samples if t.ndim else (samples[0][0], samples[1][0], samples[2][0])

    def _sample(self, t: Array) -> Samples:
        k, n = self.positions.shape
        if self.order == QUINTIC and self.orders is None and np.array_equal(t, self.times):
            assert self.velocities is not None and self.accelerations is not None
            return self.positions.copy(), self.velocities.copy(), self.accelerations.copy()
        position, velocity, acceleration = np.empty((len(t), n)), np.zeros((len(t), n)), np.zeros((len(t), n))
        index = np.searchsorted(self.times, t, side="right") - 1
        after = t > self.times[-1]
        position[after] = self.positions[-1]
        within = ~after
        if k == 1:
            self._point(0, within, position, velocity, acceleration)
            return position, velocity, acceleration
        segment = np.minimum(index, k - 2)
        orders = np.full(k, self.order, dtype=np.int8) if self.orders is None else self.orders
        order = np.minimum(orders[segment], orders[segment + 1])
        for kind, evaluate in ((LINEAR, self._linear), (CUBIC, self._cubic), (QUINTIC, self._quintic)):
            rows = within & (order == kind)
            if rows.any():
                i = segment[rows]
                tau = (t[rows] - self.times[i])[:, None]
                length = (self.times[i + 1] - self.times[i])[:, None]
                position[rows], velocity[rows], acceleration[rows] = evaluate(i, tau, length)
        self._point(k - 1, t == self.times[-1], position, velocity, acceleration)
        return position, velocity, acceleration

    def _point(
        self, k: int, rows: npt.NDArray[np.bool_], position: Array, velocity: Array, acceleration: Array
    ) -> None:
        """Writes what point `k` gives into `rows`: the end of a curve is the point itself, not its rounded curve."""
        given = self.order if self.orders is None else int(self.orders[k])
        position[rows] = self.positions[k]
        if given >= CUBIC and self.velocities is not None:
            velocity[rows] = self.velocities[k]
        if given >= QUINTIC and self.accelerations is not None:
            acceleration[rows] = self.accelerations[k]

    def _linear(self, i: npt.NDArray[np.intp], tau: Array, length: Array) -> Samples:
        p0 = self.positions[i]
        slope = (self.positions[i + 1] - p0) / length
        return p0 + slope * tau, slope, np.zeros_like(slope)

    def _cubic(self, i: npt.NDArray[np.intp], tau: Array, length: Array) -> Samples:
        assert self.velocities is not None
        p0, v0, v1 = self.positions[i], self.velocities[i], self.velocities[i + 1]
        way = self.positions[i + 1] - p0
        c2 = (3.0 * way - (2.0 * v0 + v1) * length) / length**2
        c3 = (-2.0 * way + (v0 + v1) * length) / length**3
        return (
            p0 + tau * (v0 + tau * (c2 + tau * c3)),
            v0 + tau * (2.0 * c2 + tau * 3.0 * c3),
            2.0 * c2 + tau * 6.0 * c3,
        )

    def _quintic(self, i: npt.NDArray[np.intp], tau: Array, length: Array) -> Samples:
        assert self.velocities is not None and self.accelerations is not None
        p0, v0, v1 = self.positions[i], self.velocities[i], self.velocities[i + 1]
        a0, a1 = self.accelerations[i], self.accelerations[i + 1]
        way = self.positions[i + 1] - p0
        c2 = 0.5 * a0
        c3 = (20.0 * way - (8.0 * v1 + 12.0 * v0) * length - (3.0 * a0 - a1) * length**2) / (2.0 * length**3)
        c4 = (-30.0 * way + (14.0 * v1 + 16.0 * v0) * length + (3.0 * a0 - 2.0 * a1) * length**2) / (2.0 * length**4)
        c5 = (12.0 * way - 6.0 * (v1 + v0) * length + (a1 - a0) * length**2) / (2.0 * length**5)
        return (
            p0 + tau * (v0 + tau * (c2 + tau * (c3 + tau * (c4 + tau * c5)))),
            v0 + tau * (2.0 * c2 + tau * (3.0 * c3 + tau * (4.0 * c4 + tau * 5.0 * c5))),
            2.0 * c2 + tau * (6.0 * c3 + tau * (12.0 * c4 + tau * 20.0 * c5)),
        )


def _row(point: Waypoint, n: int, what: str) -> tuple[Array, Array, Array, int, float]:
    """Positions, velocities, accelerations (0 where not given), order and time of one point."""
    values = []
    given = 0
    for k, field in enumerate(("positions", "velocities", "accelerations")):
        value = getattr(point, field)
        array = np.zeros(0) if value is None else np.asarray(value, dtype=np.float64)
        if array.size == 0 and k > 0:
            array = np.zeros(n)
        elif array.shape != (n,):
            raise InvalidArgument("TRAJ102", f"{what} has {array.size} {field}; expected {n}, one a joint")
        elif given == k:
            given = k + 1
        else:
            raise InvalidArgument("TRAJ103", f"{what} has accelerations but no velocities", hint="give velocities too")
        values.append(array)
    return values[0], values[1], values[2], given - 1, float(point.time_from_start)


def _validate(trajectory: JointTrajectory) -> None:
    names, times = trajectory.names, trajectory.times
    if not names:
        raise InvalidArgument("TRAJ100", "the trajectory names no joint")
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InvalidArgument("TRAJ104", f"joint '{repeated[0]}' is named twice in the trajectory")
    if times.ndim != 1 or times.size == 0:
        raise InvalidArgument("TRAJ101", "the trajectory has no points; expected at least one")
    shape = (times.size, len(names))
    for field in ("positions", "velocities", "accelerations"):
        array: Array | None = getattr(trajectory, field)
        if array is None:
            continue
        if array.shape != shape:
            raise InvalidArgument("TRAJ102", f"{field} have the shape {array.shape}; expected {shape}: points, joints")
        if not np.isfinite(array).all():
            k, j = (int(index) for index in np.argwhere(~np.isfinite(array))[0])
            raise InvalidArgument(
                "TRAJ105",
                f"{SINGULAR[field]} of joint '{names[j]}' at point {k} is {array[k, j]}; expected a finite number",
            )
    if trajectory.accelerations is not None and trajectory.velocities is None:
        raise InvalidArgument(
            "TRAJ103", "the trajectory has accelerations but no velocities", hint="give velocities too"
        )
    if not np.isfinite(times).all() or times[0] < 0.0:
        raise InvalidArgument("TRAJ106", "the times of the points must be finite and not negative")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if late.size:
        k = int(late[0]) + 1
        raise InvalidArgument(
            "TRAJ107", f"point {k} is at {times[k]:.6g} s, not later than point {k - 1} at {times[k - 1]:.6g} s"
        )
