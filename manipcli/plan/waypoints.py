"""Points of joint trajectories, in the form of ROS messages, and their conversion to arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import timedelta
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean

LINEAR, CUBIC, QUINTIC = 0, 1, 2
"""What a point gives: positions; velocities too; accelerations too."""

FIELDS: Final = ("positions", "velocities", "accelerations", "effort")

Values = Sequence[float] | Array


class RosDuration(Protocol):
    """builtin_interfaces/Duration; ROS 1's, with `secs` and `nsecs`, is accepted, too."""

    @property
    def sec(self) -> int: ...
    @property
    def nanosec(self) -> int: ...


class Waypoint(Protocol):
    """Fields of trajectory_msgs/JointTrajectoryPoint. Missing fields are None or empty; `effort` may be absent."""

    @property
    def positions(self) -> Values | None: ...
    @property
    def velocities(self) -> Values | None: ...
    @property
    def accelerations(self) -> Values | None: ...
    @property
    def time_from_start(self) -> float | RosDuration: ...


Point = Waypoint | Mapping[str, object]
"""The fields may also be a mapping, as in a YAML message."""


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryPoint:
    """One point: `positions` (n) rad or m, its derivatives where given, `time_from_start` [s].

    Positions may be left out where velocities or accelerations are given; they are then integrated. `effort` (n) N m
    or N is added to the command of an effort interface.
    """

    positions: Values | None = None
    time_from_start: float = 0.0
    velocities: Values | None = None
    accelerations: Values | None = None
    effort: Values | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PointArrays:
    """Points as arrays (k, n), 0 where a point does not give a value.

    Attributes:
        times: (k) [s].
        orders: (k) what each point gives, as above.
        efforts: (k, n), or None if no point gives any.
        integrated: whether some positions were integrated.
        source: the points, if the first has no positions and there is no start: positions are then displacements. Else
            None.
        led_in: whether the first row is the start.
    """

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    efforts: Array | None
    orders: npt.NDArray[np.int8]
    integrated: bool
    source: tuple[Waypoint, ...] | None
    led_in: bool


@dataclass(slots=True, eq=False)
class _Row:
    """One point while it is read; None: not given."""

    time: float
    position: Array | None
    velocity: Array | None
    acceleration: Array | None
    effort: Array | None

    @property
    def order(self) -> int:
        if self.velocity is None:
            return LINEAR
        return CUBIC if self.acceleration is None else QUINTIC


def read_points(given: Sequence[Point], begins: Point | Values | None, n: int) -> PointArrays:
    """Arrays of the points of `n` joints, after a start point `begins` (or its positions, at 0 s), if there is one.

    The start leads in to a first point that is later. Velocities and accelerations that only the first point has are 0
    in the start. Missing positions (velocities) are integrated from the point before by the trapezoid rule:

        v1 = v0 + T (a0 + a1) / 2,  p1 = p0 + T (v0 + v1) / 2

    Raises:
        InvalidArgument: no points, a point without values or with a wrong number of them, a mapping without a time,
            accelerations with positions but without velocities, efforts at only some points.
    """
    points = _as_points(given)
    for k, point in enumerate(given):
        if isinstance(point, Mapping) and "time_from_start" not in point:
            raise InvalidArgument("TRAJ113", f"point {k} has no time_from_start", hint="give it in seconds")
    start = TrajectoryPoint(begins) if isinstance(begins, Sequence | np.ndarray) else begins
    if not points:
        raise InvalidArgument("TRAJ101", "the trajectory has no points; expected at least one")
    rows = [_row(waypoint, n, f"point {k}") for k, waypoint in enumerate(points)]
    begin = None if start is None else _row(_as_point(start, "the start state"), n, "the start state")
    if begin is not None and begin.position is None:
        raise InvalidArgument("TRAJ102", "the start state has 0 positions; expected " + _one_per_joint(n))
    integrated = any(row.position is None for row in rows)
    relative = rows[0].position is None and begin is None
    before = begin if begin is not None else _Row(0.0, np.zeros(n), None, None, None)
    led_in = begin is not None and begin.time < rows[0].time
    for row in rows:
        if row.position is None:
            _integrate(before, row)
        before = row
    if led_in:
        assert begin is not None
        if begin.velocity is None and rows[0].velocity is not None:
            begin.velocity = np.zeros(n)
        if begin.acceleration is None and rows[0].acceleration is not None:
            begin.acceleration = np.zeros(n)
        if rows[0].effort is None:
            begin.effort = None
        elif begin.effort is None:
            begin.effort = np.zeros(n)
        rows.insert(0, begin)
    efforts = _efforts(rows, led_in)
    zero = np.zeros(n)
    return PointArrays(
        times=np.array([row.time for row in rows]),
        positions=np.array([zero if row.position is None else row.position for row in rows]),
        velocities=np.array([zero if row.velocity is None else row.velocity for row in rows]),
        accelerations=np.array([zero if row.acceleration is None else row.acceleration for row in rows]),
        efforts=efforts,
        orders=np.array([row.order for row in rows], dtype=np.int8),
        integrated=integrated,
        source=tuple(points) if relative else None,
        led_in=led_in,
    )


def _row(point: Waypoint, n: int, what: str) -> _Row:
    values: list[Array | None] = []
    for field in FIELDS:
        given = getattr(point, field, None)
        try:
            array = np.zeros(0) if given is None else np.atleast_1d(np.asarray(given, dtype=np.float64))
        except (TypeError, ValueError):
            raise InvalidArgument("TRAJ102", f"{what} has {field} that are not numbers: {given!r}") from None
        if array.size and array.shape != (n,):
            message = f"{what} has {array.size} {'efforts' if field == 'effort' else field}; expected "
            raise InvalidArgument("TRAJ102", message + _one_per_joint(n))
        values.append(array if array.size else None)
    position, velocity, acceleration, effort = values
    if position is None and velocity is None and acceleration is None:
        raise InvalidArgument("TRAJ102", f"{what} has 0 positions; expected {_one_per_joint(n)}")
    if position is not None and velocity is None and acceleration is not None:
        raise InvalidArgument("TRAJ103", f"{what} has accelerations but no velocities", hint="give velocities too")
    return _Row(seconds(point, what), position, velocity, acceleration, effort)


def _as_points(given: Sequence[Point]) -> list[Waypoint]:
    if not isinstance(given, Sequence):
        raise InvalidArgument("TRAJ101", f"the points are {type(given).__name__}; expected a list")
    return [_as_point(point, f"point {k}") for k, point in enumerate(given)]


def _as_point(given: Point, what: str) -> Waypoint:
    if isinstance(given, Mapping):
        known = [field.name for field in fields(TrajectoryPoint)]
        for key in given:
            if key not in known:
                raise InvalidArgument(
                    "TRAJ112", f"{what} has an unknown field '{key}'", hint=did_you_mean(str(key), known)
                )
        return TrajectoryPoint(**given)  # type: ignore[arg-type]  # values are checked where they are read
    if not hasattr(given, "positions"):
        message = f"{what} is {given!r}; expected a TrajectoryPoint, or an object with its fields"
        raise InvalidArgument("TRAJ112", message)
    return given


def columns_of(point: Waypoint, order: Sequence[int]) -> TrajectoryPoint:
    """The point with these columns of its joints."""

    def chosen(field: str) -> Array | None:
        values = getattr(point, field, None)
        return None if values is None or len(values) == 0 else np.asarray(values, dtype=np.float64)[list(order)]

    return TrajectoryPoint(
        chosen("positions"), seconds(point), chosen("velocities"), chosen("accelerations"), chosen("effort")
    )


def seconds(point: Waypoint, what: str = "a point") -> float:
    """Its `time_from_start` [s].

    Raises:
        InvalidArgument: it is not a time.
    """
    time: object = getattr(point, "time_from_start", None)
    if isinstance(time, int | float | np.number):
        return float(time)
    if isinstance(time, timedelta):
        return time.total_seconds()
    for pair in (("sec", "nanosec"), ("secs", "nsecs")):
        parts = [time.get(key) if isinstance(time, Mapping) else getattr(time, key, None) for key in pair]
        whole, nano = (0 if part is None else part for part in parts)
        if parts != [None, None] and isinstance(whole, int | np.integer) and isinstance(nano, int | np.integer):
            return float(whole + 1e-9 * nano)
    raise InvalidArgument("TRAJ113", f"{what} has the time_from_start {time!r}; expected seconds, or a ROS duration")


def _one_per_joint(n: int) -> str:
    return f"{n}, one per joint"


def _integrate(before: _Row, row: _Row) -> None:
    """Fills in what `row` lacks, from the row before; missing values there count as 0."""
    period = max(0.0, row.time - before.time)
    v0 = 0.0 if before.velocity is None else before.velocity
    a0 = 0.0 if before.acceleration is None else before.acceleration
    if row.velocity is None:
        assert row.acceleration is not None
        row.velocity = v0 + 0.5 * period * (a0 + row.acceleration)
    assert before.position is not None
    row.position = before.position + 0.5 * period * (v0 + row.velocity)


def _efforts(rows: Sequence[_Row], led_in: bool) -> Array | None:
    given = [row.effort for row in rows if row.effort is not None]
    if not given:
        return None
    if len(given) < len(rows):
        k = next(k for k, row in enumerate(rows) if row.effort is None) - led_in
        where = "the start state" if k < 0 else f"point {k}"
        raise InvalidArgument(
            "TRAJ108", f"{where} has no efforts, but other points have", hint="give efforts at every point"
        )
    return np.array(given)
