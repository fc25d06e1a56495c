"""What a joint trajectory controller asks of a trajectory, and how it leads into one and out of one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.model.robot import JointLimits, JointType
from manipcli.plan.trajectory import JointTrajectory

REST = 1.2e-7
"""Velocities below this count as zero at the end of a trajectory; ROS's own threshold (single-precision epsilon)."""

POSITION_SLACK = 1e-6
VELOCITY_SLACK = 1e-3
"""What rounding may add: rad or m, and relative. A waypoint on its limit is not beyond it."""


@dataclass(frozen=True, slots=True, eq=False)
class JointFacts:
    """The joints of a controller: names, units of their positions, limits (n), infinite where there are none."""

    joints: tuple[str, ...]
    units: tuple[str, ...]
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    continuous: Array
    wraps: bool

    @staticmethod
    def of(
        joints: tuple[str, ...], limits: Sequence[JointLimits] | None, types: Sequence[JointType] | None
    ) -> JointFacts:
        limits = [JointLimits()] * len(joints) if limits is None else limits
        types = ["revolute"] * len(joints) if types is None else types

        def bound(values: list[float | None], default: float) -> Array:
            return np.array([default if value is None else value for value in values], dtype=np.float64)

        continuous = np.array([kind == "continuous" for kind in types], dtype=np.float64)
        return JointFacts(
            joints=joints,
            units=tuple("m" if kind == "prismatic" else "rad" for kind in types),
            lower=bound([limit.lower for limit in limits], -math.inf),
            upper=bound([limit.upper for limit in limits], math.inf),
            velocity=bound([limit.velocity for limit in limits], math.inf),
            acceleration=bound([limit.acceleration for limit in limits], math.inf),
            continuous=continuous,
            wraps=bool(continuous.any()),
        )


def check_goal(trajectory: JointTrajectory, facts: JointFacts, *, allow_end_velocity: bool) -> JointTrajectory:
    """The trajectory with its joints in the controller's order.

    Raises:
        InvalidArgument: see `JointTrajectoryController.send_goal`.
    """
    for name in trajectory.names:
        if name not in facts.joints:
            raise InvalidArgument(
                "CTRL120",
                f"joint '{name}' is not one of the controller's: {', '.join(facts.joints)}",
                hint=did_you_mean(name, facts.joints, kind="joints"),
            )
    for name in facts.joints:
        if name not in trajectory.names:
            raise InvalidArgument("CTRL121", f"the trajectory has no values for joint '{name}'")
    if trajectory.orders is not None:
        k = int(np.flatnonzero(trajectory.orders != trajectory.orders[0])[0])
        raise InvalidArgument(
            "CTRL122",
            f"point {k} gives other things than point 0",
            hint="give velocities (and accelerations) at every point, or at none",
        )
    ordered = trajectory.of_joints(facts.joints)
    _check_limits(ordered, facts)
    if ordered.velocities is not None and not allow_end_velocity:
        last = ordered.velocities[-1]
        j = int(np.argmax(np.abs(last)))
        if abs(last[j]) > REST:
            raise InvalidArgument(
                "CTRL123",
                f"the trajectory ends with joint '{facts.joints[j]}' at {last[j]:.6g} {facts.units[j]}/s, not at rest",
            )
    return ordered


def _check_limits(trajectory: JointTrajectory, facts: JointFacts) -> None:
    positions = trajectory.positions
    beyond = (positions < facts.lower - POSITION_SLACK) | (positions > facts.upper + POSITION_SLACK)
    if beyond.any():
        k, j = (int(index) for index in np.argwhere(beyond)[0])
        raise InvalidArgument("CTRL124", _beyond(facts, j, float(positions[k, j]), f"point {k}"))
    if trajectory.velocities is None:
        velocities = np.diff(positions, axis=0) / np.diff(trajectory.times)[:, None]
        what = "on the way to point"
        first = 1
    else:
        velocities, what, first = trajectory.velocities, "point", 0
    fast = np.abs(velocities) > facts.velocity * (1.0 + VELOCITY_SLACK)
    if fast.any():
        k, j = (int(index) for index in np.argwhere(fast)[0])
        raise InvalidArgument(
            "CTRL125",
            f"joint '{facts.joints[j]}' moves at {velocities[k, j]:.6g} {facts.units[j]}/s {what} {k + first}; "
            f"its limit is {facts.velocity[j]:.6g} {facts.units[j]}/s",
        )


def _beyond(facts: JointFacts, j: int, value: float, where: str) -> str:
    unit = facts.units[j]
    return (
        f"joint '{facts.joints[j]}' is at {value:.6g} {unit} at {where}; "
        f"its limits are {facts.lower[j]:.6g} to {facts.upper[j]:.6g} {unit}"
    )


def outside_limits(positions: Array, facts: JointFacts, period: float) -> str | None:
    """What first lies beyond a position limit in (T, n) references of consecutive ticks; None when nothing does.

    Curves can swing over between waypoints that are inside; the slack here is ten times as large for that reason.
    """
    slack = 10.0 * POSITION_SLACK
    if not ((positions.min(axis=0) < facts.lower - slack) | (positions.max(axis=0) > facts.upper + slack)).any():
        return None
    k, j = (int(i) for i in np.argwhere((positions < facts.lower - slack) | (positions > facts.upper + slack))[0])
    return _beyond(facts, j, float(positions[k, j]), f"{k * period:.3f} s into the goal")


def lead_in(trajectory: JointTrajectory, reference: Array, facts: JointFacts) -> JointTrajectory:
    """The trajectory from `reference` (3, n) on: position, velocity, acceleration at time 0.

    The reference becomes a point at time 0 of what the trajectory's points give, unless the first point is at 0 itself.
    Continuous joints of the trajectory are shifted by whole turns, so that its first point is the nearest.
    """
    positions = trajectory.positions
    if facts.wraps:
        ahead = positions[0] - reference[0]
        turns = np.maximum(np.ceil(np.abs(ahead) / math.tau - 0.5), 0.0)
        shift = facts.continuous * math.tau * np.copysign(turns, ahead)
        if shift.any():
            positions = positions - shift
    if trajectory.times[0] == 0.0:
        if positions is trajectory.positions:
            return trajectory
        rows = (positions, trajectory.velocities, trajectory.accelerations)
        return JointTrajectory.of_arrays(trajectory.names, trajectory.times, *rows)
    return JointTrajectory.of_arrays(
        names=trajectory.names,
        times=np.concatenate([[0.0], trajectory.times]),
        positions=np.vstack([reference[0], positions]),
        velocities=None if trajectory.velocities is None else np.vstack([reference[1], trajectory.velocities]),
        accelerations=None if trajectory.accelerations is None else np.vstack([reference[2], trajectory.accelerations]),
    )


def stopping(reference: Array, acceleration: Array, period: float) -> Array:
    """References (T, 3, n) from a moving `reference` (3, n) to rest: all joints stop together, none over its limit.

    With T = max |v| / a: q = q0 + v0 (t - t^2 / (2 T)), v = v0 (1 - t / T). Without limits it stops at once.
    """
    position, velocity = np.array(reference[0]), np.array(reference[1])
    stop = float(np.max(np.abs(velocity) / acceleration))
    count = math.ceil(stop / period - 1e-6)
    table = np.zeros((count + 1, 3, len(position)))
    t = np.minimum(np.arange(count + 1) * period, stop)[:, None]
    table[:, 0] = position
    if count > 0:
        table[:, 0] += velocity * (t - t * t / (2.0 * stop))
        table[:-1, 1] = velocity * (1.0 - t[:-1] / stop)
        table[:-1, 2] = -velocity / stop
    return table
