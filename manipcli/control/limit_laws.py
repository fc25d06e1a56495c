"""Joint limits on commands, after the controllers and before the transmissions: pure functions, n joints at once.

The rules are those of ros2_control's `joint_limits` for hard limits and of ROS 1's `joint_limits_interface` for soft
ones. All arguments broadcast; infinite (or, for `k_position` and `k_velocity`, 0) means that there is no such limit. A
command that is NaN stays NaN. Limits must be valid by `refuse_limits`, which is called once, not at every tick.

A soft limit bounds the velocity v near it, before the hard one is met:

    v_min = clamp(-k_position (q - soft_lower), -v_max, v_max),   v_max likewise with soft_upper

so that a joint slows down towards it, and returns from beyond it; an effort is then bounded by the velocity bounds:

    -k_velocity (v - v_min) <= effort <= -k_velocity (v - v_max)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.elements import JointLimits, SoftLimits

POSITION_TOLERANCE: Final = 0.002
"""[rad or m] Beyond a position limit by at most this, a velocity may still lead back."""
OUT_OF_BOUNDS: Final = 0.0087
"""[rad or m] A position measured further beyond its limits than this is an error."""

Beyond = Literal["stop", "return"]
"""Effect of a velocity command while the joint is beyond its limits: none, or only back."""


def limit_position(
    command: npt.ArrayLike,
    *,
    lower: npt.ArrayLike = -math.inf,
    upper: npt.ArrayLike = math.inf,
    velocity: npt.ArrayLike = math.inf,
    acceleration: npt.ArrayLike = math.inf,
    previous: npt.ArrayLike | None = None,
    position: npt.ArrayLike | None = None,
    measured_velocity: npt.ArrayLike = 0.0,
    soft_lower: npt.ArrayLike = -math.inf,
    soft_upper: npt.ArrayLike = math.inf,
    k_position: npt.ArrayLike = 0.0,
    dt: float | None = None,
) -> Array:
    """Clamped to [lower, upper] and to what can be reached from `previous` within `dt`; [lower, upper] wins.

    The reachable range is previous -+ min(velocity, |measured_velocity| + acceleration dt) dt; with soft limits,
    previous + [v_min, v_max] dt of the module's law at q = previous.

    Args:
        command: (n) rad or m.
        lower, upper, velocity, acceleration: hard limits.
        previous: (n) the command before; None: the measured position.
        position: (n) measured; None where `previous` is given.
        measured_velocity: (n), only for the acceleration.
        soft_lower, soft_upper, k_position: soft limits; k_position [1/s].
        dt: [s], above 0; needed by the limits of velocity and acceleration and by soft limits.

    Returns:
        (n)

    Raises:
        InvalidArgument: a measured position is more than `OUT_OF_BOUNDS` beyond its limits; neither `previous` nor
            `position`, or no `dt`, is given while a limit needs it; a dt that is not above 0.
    """
    low, high = _floats(lower), _floats(upper)
    if position is not None:
        _refuse_out_of_bounds(_floats(position), low, high)
    limited = _floats(command)
    before = previous if previous is not None else position
    if dt is None:
        if not (np.isinf([*np.ravel(velocity), *np.ravel(acceleration)]).all() and np.all(_floats(k_position) <= 0.0)):
            raise InvalidArgument("CTRL193", "a velocity limit on positions needs `dt`")
        return np.asarray(np.minimum(np.maximum(limited, low), high))
    _refuse_time(dt)
    fastest = np.minimum(_floats(velocity), np.abs(_floats(measured_velocity)) + _floats(acceleration) * dt)
    if before is None:
        if np.isfinite(fastest).any() or np.any(_floats(k_position) > 0.0):
            raise InvalidArgument("CTRL190", "a velocity limit on positions needs `previous`, or `position`")
    else:
        start = _floats(before)
        least, most = _soft_velocities(start, fastest, soft_lower, soft_upper, k_position)
        limited = np.minimum(np.maximum(limited, start + least * dt), start + most * dt)
    return np.asarray(np.minimum(np.maximum(limited, low), high))


def limit_velocity(
    command: npt.ArrayLike,
    *,
    velocity: npt.ArrayLike = math.inf,
    dt: float | None = None,
    position: npt.ArrayLike | None = None,
    lower: npt.ArrayLike = -math.inf,
    upper: npt.ArrayLike = math.inf,
    acceleration: npt.ArrayLike = math.inf,
    previous: npt.ArrayLike | None = None,
    soft_lower: npt.ArrayLike = -math.inf,
    soft_upper: npt.ArrayLike = math.inf,
    k_position: npt.ArrayLike = 0.0,
    beyond: Beyond = "stop",
) -> Array:
    """Clamped to -+ velocity, to what reaches no position limit within `dt`, and to previous -+ acceleration dt.

    Beyond a position limit by up to `POSITION_TOLERANCE` it may lead back, but not further out; beyond that it is 0,
    or with `beyond="return"` it may still lead back. Where position and acceleration limits exclude each other, the
    command is allowed between them: the deceleration stays within its limit.

    Args:
        command: (n) rad/s or m/s.
        velocity, acceleration, lower, upper: hard limits.
        dt: [s], above 0; needed with `position` and with `previous`.
        position: (n) measured; None: position limits, soft ones included, are ignored.
        previous: (n) the velocity command before; None: the acceleration is not limited.
        soft_lower, soft_upper, k_position: soft limits; k_position [1/s].
        beyond: see above.

    Returns:
        (n)

    Raises:
        InvalidArgument: a dt that is not above 0, or none where it is needed.
    """
    fastest = _floats(velocity)
    if dt is None:
        if position is not None or previous is not None:
            raise InvalidArgument("CTRL193", "limits on velocities by `position` or `previous` need `dt`")
        return np.asarray(np.minimum(np.maximum(_floats(command), -fastest), fastest))
    _refuse_time(dt)
    low, high = -fastest, fastest
    if position is not None:
        q, q_low, q_high = _floats(position), _floats(lower), _floats(upper)
        low = np.maximum(low, np.minimum((q_low - q) / dt, 0.0))
        high = np.minimum(high, np.maximum((q_high - q) / dt, 0.0))
        if beyond == "stop":
            out = (q > q_high + POSITION_TOLERANCE) | (q < q_low - POSITION_TOLERANCE)
            low, high = np.where(out, 0.0, low), np.where(out, 0.0, high)
        least, most = _soft_velocities(q, fastest, soft_lower, soft_upper, k_position)
        # The soft limit leads back only as far as the hard limits allow.
        low, high = np.minimum(np.maximum(low, least), high), np.maximum(np.minimum(high, most), low)
    if previous is not None:
        change, before = _floats(acceleration) * dt, _floats(previous)
        low, high = np.maximum(low, before - change), np.minimum(high, before + change)
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.asarray(np.minimum(np.maximum(_floats(command), low), high))


def limit_effort(
    command: npt.ArrayLike,
    *,
    effort: npt.ArrayLike = math.inf,
    position: npt.ArrayLike | None = None,
    velocity: npt.ArrayLike | None = None,
    lower: npt.ArrayLike = -math.inf,
    upper: npt.ArrayLike = math.inf,
    max_velocity: npt.ArrayLike = math.inf,
    soft_lower: npt.ArrayLike = -math.inf,
    soft_upper: npt.ArrayLike = math.inf,
    k_position: npt.ArrayLike = 0.0,
    k_velocity: npt.ArrayLike | None = None,
) -> Array:
    """Clamped to -+ effort, without pushing further out at a position limit, or accelerating beyond the velocity limit.

    At or below `lower` and not moving back (velocity <= 0) the command cannot be negative; above `max_velocity` it
    cannot be positive; and the mirror images. Then the soft limits, by the module's law.

    Args:
        command: (n) N m or N.
        effort, lower, upper, max_velocity: hard limits.
        position, velocity: (n) measured; None: not limited by it.
        soft_lower, soft_upper, k_position, k_velocity: soft limits; k_position [1/s], k_velocity [N m s/rad or N s/m].

    Returns:
        (n)
    """
    most = _floats(effort)
    lowest, highest = -most, most
    if velocity is not None:
        v, fastest = _floats(velocity), _floats(max_velocity)
        no_push, no_pull = v > fastest, v < -fastest
        if position is not None:
            q = _floats(position)
            no_push = no_push | ((q >= _floats(upper)) & (v >= 0.0))
            no_pull = no_pull | ((q <= _floats(lower)) & (v <= 0.0))
        if k_velocity is not None:
            stiffness = _floats(k_velocity)
            slow, fast = -fastest, fastest
            if position is not None:
                slow, fast = _soft_velocities(_floats(position), fastest, soft_lower, soft_upper, k_position)
            acts = stiffness > 0.0
            with np.errstate(invalid="ignore"):  # 0 times infinity, where it does not act
                under, over = -stiffness * (v - slow), -stiffness * (v - fast)
            lowest = np.where(acts, np.minimum(np.maximum(under, lowest), highest), lowest)
            highest = np.where(acts, np.minimum(np.maximum(over, -most), most), highest)
        highest = np.where(no_push, np.minimum(highest, 0.0), highest)
        lowest = np.where(no_pull, np.maximum(lowest, 0.0), lowest)
    return np.asarray(np.minimum(np.maximum(_floats(command), lowest), highest))


def limit_acceleration(
    command: npt.ArrayLike,
    *,
    acceleration: npt.ArrayLike = math.inf,
    deceleration: npt.ArrayLike | None = None,
    velocity: npt.ArrayLike | None = None,
) -> Array:
    """Clamped to -+ acceleration; to -+ deceleration where it acts against the measured `velocity` (n).

    Args:
        command: (n) rad/s2 or m/s2.
        acceleration, deceleration: limits; no deceleration: as the acceleration.
        velocity: (n) measured; None: the acceleration holds everywhere.

    Returns:
        (n)
    """
    wanted, most = _floats(command), _floats(acceleration)
    if deceleration is not None and velocity is not None:
        most = np.where(wanted * _floats(velocity) < 0.0, _floats(deceleration), most)
    return np.asarray(np.minimum(np.maximum(wanted, -most), most))


def limit_array(values: Iterable[float | None], default: float = math.inf) -> Array:
    """(n) stated limits, with `default` where there is none."""
    return np.array([default if value is None else value for value in values], dtype=np.float64)


def refuse_limits(
    lower: npt.ArrayLike = -math.inf, upper: npt.ArrayLike = math.inf, **sizes: npt.ArrayLike | None
) -> None:
    """Refuse contradictory limits.

    Raises:
        InvalidArgument: one of `sizes` (None: there is none) is below 0, `lower` is above `upper`, or one is NaN.
    """
    for name, size in sizes.items():
        if size is not None and not (_floats(size) >= 0.0).all():
            raise InvalidArgument("CTRL194", f"the limit `{name}` is {_floats(size)}; expected 0 or more")
    least, most = _floats(lower), _floats(upper)
    if not (least <= most).all():
        raise InvalidArgument(
            "CTRL194", f"the limits are {least} to {most}; expected each lower limit at or below its upper limit"
        )


@dataclass(frozen=True, slots=True)
class LimitArrays:
    """Limits of joints as arrays (n); where there is no limit, infinite, and the gains 0."""

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    effort: Array
    soft_lower: Array
    soft_upper: Array
    k_position: Array
    k_velocity: Array

    @classmethod
    def of(cls, limits: Sequence[JointLimits]) -> LimitArrays:
        """The arrays of these joints.

        Raises:
            InvalidArgument: see `refuse_limits`.
        """
        soft = [limit.soft or SoftLimits() for limit in limits]
        found = cls(
            lower=limit_array((limit.lower for limit in limits), -math.inf),
            upper=limit_array(limit.upper for limit in limits),
            velocity=limit_array(limit.velocity for limit in limits),
            acceleration=limit_array(limit.acceleration for limit in limits),
            effort=limit_array(limit.effort for limit in limits),
            soft_lower=limit_array((own.lower for own in soft), -math.inf),
            soft_upper=limit_array(own.upper for own in soft),
            k_position=np.array([own.k_position for own in soft]),
            k_velocity=np.array([own.k_velocity for own in soft]),
        )
        refuse_limits(
            found.lower, found.upper, velocity=found.velocity, acceleration=found.acceleration, effort=found.effort,
            k_position=found.k_position, k_velocity=found.k_velocity,
        )  # fmt: skip
        return found

    def at(self, where: npt.NDArray[np.intp]) -> LimitArrays:
        """The limits of some joints, by index."""
        return LimitArrays(*(getattr(self, field.name)[where] for field in fields(self)))


def _refuse_time(dt: float) -> None:
    if not dt > 0.0:
        raise InvalidArgument("CTRL193", f"dt is {dt} s; expected a time above 0")


def _floats(values: npt.ArrayLike) -> Array:
    return np.asarray(values, dtype=np.float64)


def _soft_velocities(
    q: Array, fastest: Array, soft_lower: npt.ArrayLike, soft_upper: npt.ArrayLike, k_position: npt.ArrayLike
) -> tuple[Array, Array]:
    """(v_min, v_max) of the module's law; -+ fastest where k_position is 0."""
    k = _floats(k_position)
    acts = k > 0.0
    if not acts.any():
        return -fastest, fastest
    with np.errstate(invalid="ignore"):  # 0 times infinity, where it does not act
        least = np.where(acts, -k * (q - _floats(soft_lower)), -math.inf)
        most = np.where(acts, -k * (q - _floats(soft_upper)), math.inf)
    return np.minimum(np.maximum(least, -fastest), fastest), np.minimum(np.maximum(most, -fastest), fastest)


def _refuse_out_of_bounds(position: Array, lower: Array, upper: Array) -> None:
    beyond = np.atleast_1d(np.maximum(position - upper, lower - position))
    if not np.any(beyond > OUT_OF_BOUNDS):
        return
    k = int(np.argmax(beyond))
    q = float(np.broadcast_to(position, beyond.shape)[k])
    limits = [float(np.broadcast_to(bound, beyond.shape)[k]) for bound in (lower, upper)]
    message = f"joint {k} is measured at {q:.6g}, more than {OUT_OF_BOUNDS:g} beyond its limits "
    raise InvalidArgument(
        "CTRL191",
        f"{message}{limits[0]:g} to {limits[1]:g}",
        hint="check the sensor, and whether the limits are narrower than the robot's",
    )
