"""Joint trajectories: points in time, and the interpolation between them.

    trajectory = JointTrajectory(["joint_1"], [TrajectoryPoint([1.0], time_from_start=2.0)], start=TrajectoryPoint([0]))
    position, velocity, acceleration = trajectory.sample(0.5)

Between two points the curve is linear, cubic or quintic by what *both* ends give: positions; positions and velocities;
positions, velocities and accelerations. A planned trajectory is this same type with a point at every control tick, so
that sampling at ticks returns the planned values themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.plan.waypoints import CUBIC, LINEAR, QUINTIC, Point, TrajectoryPoint, Waypoint, columns_of, read_points

__all__ = ["CUBIC", "LINEAR", "QUINTIC", "JointTrajectory", "Samples", "TrajectoryPoint", "Waypoint"]

Samples = tuple[Array, Array, Array]
"""Position, velocity, acceleration; each (n), or (T, n)."""

Interpolation = Literal["splines", "none"]

NO_JOINT = "the trajectory has no joint names"
SINGULAR = {"positions": "position", "velocities": "velocity", "accelerations": "acceleration", "efforts": "effort"}


@dataclass(frozen=True, slots=True, eq=False, init=False)
class JointTrajectory:
    """A trajectory of single points, as ROS writes them.

    Args:
        names: (n) joints, in the order of every point's arrays.
        points: `TrajectoryPoint`s or whatever has their fields, a mapping too; times strictly increasing from the
            start of the goal. Points without positions have theirs integrated from their velocities, or accelerations,
            by the trapezoid rule; such a trajectory can only be sampled with a `start`.
        start: where the joints are at its own `time_from_start`, or their positions (n) at 0 s; leads in to the first
            point. Velocities and accelerations that only the first point has are 0 in it. Unused when the first point's
            time is not later: the reference then steps to that point.
        interpolation: `splines`; or `none`: between two points the later one holds at once (the lead-in holds `start`).

    Attributes:
        names: (n).
        times: (k) [s] strictly increasing.
        positions: (k, n); displacements while a start is missing, see `source`.
        velocities, accelerations: (k, n), or None if no point gives them.
        efforts: (k, n) N m or N, or None.
        orders: (k) what each point gives: 0 positions, 1 velocities too, 2 accelerations too. None: the arrays
            given, the same for all points. A value that a point does not give is 0 in its array and is not used.
        interpolation: see above.
        led_in: whether the first row is a start.
        integrated: whether some positions were integrated.
        source: the points, while the start from which to integrate the first is missing; else None.

    Raises:
        InvalidArgument: no name, no point, a repeated name, a wrong number of values, NaN or infinity, a negative first
            time, times that do not increase, accelerations without velocities, efforts at some points only.
    """

    names: tuple[str, ...]
    times: Array
    positions: Array
    velocities: Array | None
    accelerations: Array | None
    efforts: Array | None
    orders: npt.NDArray[np.int8] | None
    interpolation: Interpolation
    led_in: bool
    integrated: bool
    source: tuple[Waypoint, ...] | None

    def __init__(
        self,
        names: Sequence[str],
        points: Sequence[Point],
        start: Point | Sequence[float] | Array | None = None,
        *,
        interpolation: Interpolation = "splines",
    ) -> None:
        if isinstance(names, str):
            raise InvalidArgument("TRAJ100", f"the joint names are a string, '{names}'; expected a list")
        if not names:
            raise InvalidArgument("TRAJ100", NO_JOINT)
        read = read_points(points, start, len(names))
        highest = int(read.orders.max())
        self._set(
            names=tuple(names), times=read.times, positions=read.positions,
            velocities=read.velocities if highest >= CUBIC else None,
            accelerations=read.accelerations if highest == QUINTIC else None,
            efforts=read.efforts, orders=None if bool((read.orders == highest).all()) else read.orders,
            interpolation=interpolation, led_in=read.led_in, integrated=read.integrated, source=read.source,
        )  # fmt: skip

    @classmethod
    def of_arrays(
        cls,
        names: Sequence[str],
        times: npt.ArrayLike,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike | None = None,
        accelerations: npt.ArrayLike | None = None,
        efforts: npt.ArrayLike | None = None,
        *,
        orders: npt.NDArray[np.int8] | None = None,
        interpolation: Interpolation = "splines",
        led_in: bool = False,
    ) -> JointTrajectory:
        """A trajectory of arrays: `times` (k), the others (k, n) or None; arrays of float64 are not copied.

        Raises:
            InvalidArgument: as the constructor.
        """
        made = object.__new__(cls)
        made._set(
            names=tuple(names), times=times, positions=positions, velocities=velocities, accelerations=accelerations,
            efforts=efforts, orders=orders, interpolation=interpolation, led_in=led_in, integrated=False, source=None,
        )  # fmt: skip
        return made

    def _set(self, **fields: object) -> None:
        for field, value in fields.items():
            array = field in (*SINGULAR, "times") and value is not None
            object.__setattr__(self, field, _read_only(value) if array else value)
        _validate(self)

    def _with(self, **changes: object) -> JointTrajectory:
        """The same with other fields."""
        made = object.__new__(JointTrajectory)
        made._set(**({field: getattr(self, field) for field in self.__slots__} | changes))
        return made

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    @property
    def order(self) -> int:
        """The highest of what the points give: 0 positions, 1 velocities too, 2 accelerations too."""
        if self.velocities is None:
            return LINEAR
        return CUBIC if self.accelerations is None else QUINTIC

    @property
    def order_of_points(self) -> npt.NDArray[np.int8]:
        """(k) what each point gives, see `orders`."""
        return np.full(len(self.times), self.order, dtype=np.int8) if self.orders is None else self.orders

    def sample(self, time: float | npt.ArrayLike) -> Samples:
        """Position, velocity and acceleration at `time` [s] from the start of the goal.

        With T the duration of a segment, t the time since its first point, D the distance between its points:
        linear: p0 + D t / T. Cubic: c2 = (3 D - (2 v0 + v1) T) / T^2, c3 = (-2 D + (v0 + v1) T) / T^3.
        Quintic: c2 = a0 / 2, c3 = (20 D - (8 v1 + 12 v0) T - (3 a0 - a1) T^2) / (2 T^3),
        c4 = (-30 D + (14 v1 + 16 v0) T + (3 a0 - 2 a1) T^2) / (2 T^4),
        c5 = (12 D - 6 (v1 + v0) T + (a1 - a0) T^2) / (2 T^5).

        At the time of a point its own values are returned exactly; where two segments meet, the later one gives what
        the point does not. After the last point, the last point is returned.

        Args:
            time: a number, or (T,).

        Returns:
            Three arrays (n), or (T, n): rad or m, per second, per second squared.

        Raises:
            InvalidArgument: a time that is NaN or before the first point, or a trajectory of integrated points that has
                no start.
        """
        t = np.asarray(time, dtype=np.float64)
        flat = np.atleast_1d(t)
        self._refuse(flat)
        samples = self._sample(flat)
        return samples if t.ndim else (samples[0][0], samples[1][0], samples[2][0])

    def sample_effort(self, time: float | npt.ArrayLike) -> Array:
        """Effort at `time`, linear between two points: (n), or (T, n); N m or N; 0 if no point gives any.

        Raises:
            InvalidArgument: as `sample`.
        """
        t = np.asarray(time, dtype=np.float64)
        flat = np.atleast_1d(t)
        self._refuse(flat)
        if self.efforts is None:
            efforts = np.zeros((len(flat), len(self.names)))
        elif self.interpolation == "none":
            efforts = self.efforts[self._held(flat)]
        else:
            efforts = np.stack([np.interp(flat, self.times, column) for column in self.efforts.T], axis=1)
        return efforts if t.ndim else efforts[0]

    def of_joints(self, names: Sequence[str]) -> JointTrajectory:
        """The trajectory of some of its joints, or of all in another order."""
        if tuple(names) == self.names:
            return self
        order = [self.names.index(name) for name in names]

        def columns(values: Array | None) -> Array | None:
            return None if values is None else values[:, order]

        source = None if self.source is None else tuple(columns_of(point, order) for point in self.source)
        return self._with(
            names=tuple(names), positions=self.positions[:, order], velocities=columns(self.velocities),
            accelerations=columns(self.accelerations), efforts=columns(self.efforts), source=source,
        )  # fmt: skip

    def with_spline_velocities(self, begin: Array | None = None) -> JointTrajectory:
        """With the velocities of the cubic spline that ends at rest, if points give only positions.

        Velocity and acceleration are then continuous. Other trajectories are returned unchanged.

        Args:
            begin: (n) the velocity of the first point; None: at rest.
        """
        if self.velocities is not None or len(self.times) < 2:
            return self
        from scipy.interpolate import CubicSpline

        rest = np.zeros(len(self.names))
        spline = CubicSpline(self.times, self.positions, bc_type=((1, rest if begin is None else begin), (1, rest)))
        return self._with(velocities=spline(self.times, 1))

    def with_interpolation(self, interpolation: Interpolation) -> JointTrajectory:
        """The same points with this interpolation."""
        return self if interpolation == self.interpolation else self._with(interpolation=interpolation)

    def _refuse(self, t: Array) -> None:
        if self.source is not None:
            hint = "give a start: JointTrajectory(names, points, start)"
            raise InvalidArgument(
                "TRAJ111", "the first point has no positions, and the trajectory has no start", hint=hint
            )
        if not bool((t >= self.times[0]).all()):
            raise InvalidArgument(
                "TRAJ110",
                f"cannot sample at {float(t.min()):.6g} s: the trajectory begins at {float(self.times[0]):.6g} s",
            )

    def _held(self, t: Array) -> npt.NDArray[np.intp]:
        index = np.minimum(np.searchsorted(self.times, t, side="right"), len(self.times) - 1)
        if self.led_in:
            index[t < self.times[min(1, len(self.times) - 1)]] = 0
        return index

    def _sample(self, t: Array) -> Samples:
        k, n = self.positions.shape
        if self.interpolation == "none":
            held = self._held(t)
            zero = np.zeros((len(t), n))
            return (
                self.positions[held],
                zero.copy() if self.velocities is None else self.velocities[held],
                zero if self.accelerations is None else self.accelerations[held],
            )
        if self.order == QUINTIC and self.orders is None and np.array_equal(t, self.times):
            assert self.velocities is not None and self.accelerations is not None
            return self.positions.copy(), self.velocities.copy(), self.accelerations.copy()
        position, velocity, acceleration = np.empty((len(t), n)), np.zeros((len(t), n)), np.zeros((len(t), n))
        within = t <= self.times[-1]
        if k > 1 and within.any():
            segment = np.minimum(np.searchsorted(self.times, t, side="right") - 1, k - 2)
            orders = self.order_of_points
            pairs = np.minimum(orders[:-1], orders[1:])
            order = np.where(within, pairs[segment], -1)
            for kind, evaluate in ((LINEAR, self._linear), (CUBIC, self._cubic), (QUINTIC, self._quintic)):
                rows = order == kind
                if rows.any():
                    i = segment[rows]
                    tau = (t[rows] - self.times[i])[:, None]
                    length = (self.times[i + 1] - self.times[i])[:, None]
                    position[rows], velocity[rows], acceleration[rows] = evaluate(i, tau, length)
        # The last point is returned exactly, without rounding of the curve. The curve supplies what the point lacks; a
        # straight line without velocities ends at rest, because it rests afterwards.
        last = t >= self.times[-1]
        given = self.order if self.orders is None else int(self.orders[-1])
        position[last] = self.positions[-1]
        if given == LINEAR:
            velocity[last] = 0.0
        elif self.velocities is not None:
            velocity[last] = self.velocities[-1]
        if given >= QUINTIC and self.accelerations is not None:
            acceleration[last] = self.accelerations[-1]
        return position, velocity, acceleration

    def _linear(self, i: npt.NDArray[np.intp], tau: Array, length: Array) -> Samples:
        p0 = self.positions[i]
        slope = (self.positions[i + 1] - p0) / length
        return p0 + slope * tau, slope, np.zeros_like(slope)

    def _cubic(self, i: npt.NDArray[np.intp], tau: Array, length: Array) -> Samples:
        assert self.velocities is not None
        p0, v0, v1 = self.positions[i], self.velocities[i], self.velocities[i + 1]
        delta = self.positions[i + 1] - p0
        c2 = (3.0 * delta - (2.0 * v0 + v1) * length) / length**2
        c3 = (-2.0 * delta + (v0 + v1) * length) / length**3
        return (
            p0 + tau * (v0 + tau * (c2 + tau * c3)),
            v0 + tau * (2.0 * c2 + tau * 3.0 * c3),
            2.0 * c2 + tau * 6.0 * c3,
        )

    def _quintic(self, i: npt.NDArray[np.intp], tau: Array, length: Array) -> Samples:
        assert self.velocities is not None and self.accelerations is not None
        p0, v0, v1 = self.positions[i], self.velocities[i], self.velocities[i + 1]
        a0, a1 = self.accelerations[i], self.accelerations[i + 1]
        delta = self.positions[i + 1] - p0
        c2 = 0.5 * a0
        c3 = (20.0 * delta - (8.0 * v1 + 12.0 * v0) * length - (3.0 * a0 - a1) * length**2) / (2.0 * length**3)
        c4 = (-30.0 * delta + (14.0 * v1 + 16.0 * v0) * length + (3.0 * a0 - 2.0 * a1) * length**2) / (2.0 * length**4)
        c5 = (12.0 * delta - 6.0 * (v1 + v0) * length + (a1 - a0) * length**2) / (2.0 * length**5)
        return (
            p0 + tau * (v0 + tau * (c2 + tau * (c3 + tau * (c4 + tau * c5)))),
            v0 + tau * (2.0 * c2 + tau * (3.0 * c3 + tau * (4.0 * c4 + tau * 5.0 * c5))),
            2.0 * c2 + tau * (6.0 * c3 + tau * (12.0 * c4 + tau * 20.0 * c5)),
        )


def _read_only(values: object) -> Array:
    array = np.asarray(values, dtype=np.float64).view()
    array.flags.writeable = False
    return array


def _validate(trajectory: JointTrajectory) -> None:
    names, times = trajectory.names, trajectory.times
    if not names:
        raise InvalidArgument("TRAJ100", NO_JOINT)
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InvalidArgument("TRAJ104", f"duplicate joint '{repeated[0]}' in the trajectory")
    if times.ndim != 1 or times.size == 0:
        raise InvalidArgument("TRAJ101", "the trajectory has no points; expected at least one")
    shape = (times.size, len(names))
    if trajectory.interpolation not in ("splines", "none"):
        message = f"interpolation '{trajectory.interpolation}'; expected 'splines' or 'none'"
        raise InvalidArgument("TRAJ109", message)
    for field in ("positions", "velocities", "accelerations", "efforts"):
        array: Array | None = getattr(trajectory, field)
        if array is None:
            continue
        if array.shape != shape:
            raise InvalidArgument("TRAJ102", f"{field} have the shape {array.shape}; expected {shape} (points, joints)")
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
