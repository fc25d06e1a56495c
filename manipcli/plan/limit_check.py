"""Verification that a trajectory keeps its limits: point by point, and by finite differences of its positions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from manipcli.core.errors import Loc, NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.text import distinguished
from manipcli.model.robot import RobotModel
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.trajectory import JointTrajectory

TOLERANCE = 0.005
"""Relative excess of velocity, acceleration and jerk that is accepted."""
PER = {"velocity": "/s", "acceleration": "/s2", "jerk": "/s3"}
"""Suffix of the unit of each, after the unit of the position."""
ORDER = {"velocity": 1, "acceleration": 2, "jerk": 3}
"""Power of the duration with which each decreases along the same path."""
_POSITION = 1e-9  # rad or m: rounding of a trajectory that touches its limit


def verify(
    trajectory: JointTrajectory,
    limits: MotionLimits,
    *,
    tolerance: float = TOLERANCE,
    given: JointTrajectory | None = None,
) -> None:
    """Refuse a trajectory that exceeds a limit of position, velocity, acceleration or (where finite) jerk.

    Velocity and acceleration are checked both as given by the points and as difference quotients between neighbouring
    points, (q_k+1 - q_k)/dt and (v_k+1 - v_k)/dt. These are means over the interval, so a motion within its limits
    passes them, too.

    Args:
        trajectory: a point at every control tick; its names are those of `limits`.
        limits: infinite entries are not checked.
        tolerance: relative; position has none.
        given: the points that a user wrote, if any: the hint explains how to slow them down.

    Raises:
        NotPlannable: names the joint, the value, the limit and the time.
    """
    q, times = trajectory.positions, trajectory.times
    _position(trajectory, limits)
    dt = np.diff(times)[:, None]
    rate = np.diff(q, axis=0) / dt
    v = trajectory.velocities
    _bounded("velocity", rate, limits.velocity, times, limits, tolerance, given)
    if v is None:
        return
    _bounded("velocity", v, limits.velocity, times, limits, tolerance, given)
    _bounded("acceleration", np.diff(v, axis=0) / dt, limits.acceleration, times, limits, tolerance, given)
    a = trajectory.accelerations
    if a is None:
        return
    _bounded("acceleration", a, limits.acceleration, times, limits, tolerance, given)
    if np.isfinite(limits.jerk).any():
        _bounded("jerk", np.diff(a, axis=0) / dt, limits.jerk, times, limits, tolerance, given)


def verify_written(
    robot: RobotModel,
    written: Sequence[tuple[str, float, Loc]],
    *,
    when: str = "",
) -> None:
    """Refuse a position in the task file that is outside its joint's limits.

    Args:
        robot: of the joints.
        written: (joint, position, its location below the step's verb).
        when: the time of the point, as text.

    Raises:
        NotPlannable: names the joint, the position, the limit, and the location of the position.
    """
    for name, value, loc in written:
        joint = robot.joint(name)
        lower, upper = joint.limits.within_soft
        if max(lower - value, value - upper) > _POSITION:
            side = 0 if value < lower else 1
            limit, soft = (lower, upper)[side], joint.limits.is_soft(side)
            refusal = _beyond(name, value, limit, side, soft, f"goes to {{}}{when}", joint.unit)
            raise NotPlannable(refusal.cause, hint=joint.meant(value) or refusal.hint, loc=loc)


def _beyond(
    name: str,
    value: float,
    limit: float,
    side: int,
    soft: bool,
    does: str,
    unit: str,
    *,
    change: str = "the goal",
) -> NotPlannable:
    """The refusal of a joint that `does` something at a position, {}, beyond this limit; `change` is for the hint."""
    word = ("lower", "upper")[side]
    there, most = distinguished(value, limit, form=".4f")
    bound = f"{'soft ' if soft else ''}{word} limit {most} {unit}"
    message = f"joint '{name}' {does.format(f'{there} {unit}')}, beyond its {bound}"
    hint = f"change {change}, or `soft_{word}` or `k_position` in the robot file; plans stay within soft limits"
    return NotPlannable(message, hint=hint if soft else None)


def overshoot(trajectory: JointTrajectory, limits: MotionLimits) -> Array:
    """(n) how far each joint goes beyond its position limits [rad or m]; 0 where it does not."""
    worst = _outside(trajectory, limits).max(axis=0)
    return np.where(worst > _POSITION, worst, 0.0)


def _outside(trajectory: JointTrajectory, limits: MotionLimits) -> Array:
    """(k, n) how far beyond the nearer limit; negative inside."""
    q = trajectory.positions
    return np.maximum(limits.lower - q, q - limits.upper)


def _position(trajectory: JointTrajectory, limits: MotionLimits) -> None:
    q, outside = trajectory.positions, _outside(trajectory, limits)
    k, i = np.unravel_index(int(np.argmax(outside)), outside.shape)
    if outside[k, i] > _POSITION:
        name, value, side = trajectory.names[i], float(q[k, i]), 0 if q[k, i] < limits.lower[i] else 1
        limit, soft = (limits.lower, limits.upper)[side][i], (name, side) in limits.soft
        unit = limits.unit(name)
        if k == 0:
            raise _beyond(
                name, value, limit, side, soft, "begins at {}", unit, change="that pose, or the task's `start`"
            )
        raise _beyond(name, value, limit, side, soft, f"goes to {{}} at t = {trajectory.times[k]:.3f} s", unit)


def _bounded(
    word: str,
    values: Array,
    limit: Array,
    times: Array,
    limits: MotionLimits,
    tolerance: float,
    given: JointTrajectory | None,
) -> None:
    """|values| (k, n) <= limit (n) within `tolerance`."""
    ratio = np.abs(values) / limit
    k, i = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
    if ratio[k, i] > 1.0 + tolerance:
        name = limits.names[i]
        needed, most = distinguished(abs(values[k, i]), limit[i])
        unit = limits.unit(name) + PER[word]
        longer = math.ceil(100.0 * float(ratio[k, i]) ** (1.0 / ORDER[word])) / 100.0
        raise NotPlannable(
            f"joint '{name}' needs {word} {needed} {unit} at t = {times[k]:.3f} s; its limit is {most} {unit}",
            hint=None if given is None else _slower(given, longer),
        )


def _slower(given: JointTrajectory, longer: float) -> str:
    words = ["multiply every `time_from_start` by it"]
    if given.velocities is not None:
        words.append("divide `velocities` by it")
    if given.accelerations is not None:
        words.append("divide `accelerations` by its square")
    return f"slow the trajectory down by a factor of {longer:g}: {', '.join(words)}"
