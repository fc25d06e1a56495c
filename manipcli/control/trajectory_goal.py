"""Goals of joint trajectory controllers and their validation; the interfaces of such controllers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, get_args

import numpy as np
import numpy.typing as npt

from manipcli.control.action import ErrorCode, GoalRejected
from manipcli.control.limit_laws import limit_array
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean, distinguished
from manipcli.description.elements import JointLimits, JointType
from manipcli.plan.motion import JointTolerance
from manipcli.plan.trajectory import LINEAR, JointTrajectory
from manipcli.spec.controllers import Interface

REST = 1.2e-7
"""Velocities below this count as zero at the end of a trajectory; ROS's own threshold (single-precision epsilon)."""

POSITION_SLACK = 1e-6
VELOCITY_SLACK = 1e-3
"""Tolerances for rounding: rad or m, and relative. A waypoint on its limit is not beyond it."""


@dataclass(frozen=True, slots=True, eq=False)
class JointFacts:
    """The joints of a controller: names, units of their positions, limits (n), infinite where there is no limit."""

    joints: tuple[str, ...]
    units: tuple[str, ...]
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    continuous: Array
    wraps: bool

    @staticmethod
    def of(
        joints: tuple[str, ...], limits: Sequence[JointLimits] | None, types: Sequence[JointType] | None
    ) -> JointFacts:
        limits = [JointLimits()] * len(joints) if limits is None else limits
        types = ["revolute"] * len(joints) if types is None else types

        continuous = np.array([kind == "continuous" for kind in types], dtype=np.float64)
        return JointFacts(
            joints=joints,
            units=tuple("m" if kind == "prismatic" else "rad" for kind in types),
            lower=limit_array((limit.lower for limit in limits), -math.inf),
            upper=limit_array(limit.upper for limit in limits),
            velocity=limit_array(limit.velocity for limit in limits),
            acceleration=limit_array(limit.acceleration for limit in limits),
            jerk=limit_array(limit.jerk for limit in limits),
            continuous=continuous,
            wraps=bool(continuous.any()),
        )

    def some(self, joints: tuple[str, ...]) -> JointFacts:
        """The facts of these joints only."""
        if joints == self.joints:
            return self
        k = [self.joints.index(joint) for joint in joints]
        return JointFacts(
            joints=joints,
            units=tuple(self.units[i] for i in k),
            lower=self.lower[k], upper=self.upper[k], velocity=self.velocity[k], acceleration=self.acceleration[k],
            jerk=self.jerk[k], continuous=self.continuous[k], wraps=bool(self.continuous[k].any()),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryGoal:
    """A trajectory with its start time and tolerances: the goal of control_msgs/FollowJointTrajectory.

    Attributes:
        trajectory: of all joints of the controller in any order, or of some if that is allowed.
        start_time: [s] simulated time of the trajectory's time 0; 0: the next update.
        path_tolerance, goal_tolerance: instead of the controller's own; see `JointTolerance`.
        goal_time_tolerance: [s] likewise.
    """

    trajectory: JointTrajectory
    start_time: float = 0.0
    path_tolerance: tuple[JointTolerance, ...] = ()
    goal_tolerance: tuple[JointTolerance, ...] = ()
    goal_time_tolerance: float = 0.0


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Which goals a controller accepts; named as the parameters of ROS 2."""

    allow_partial_joints_goal: bool
    allow_nonzero_velocity_at_trajectory_end: bool
    allow_integration_in_goal_trajectories: bool
    efforts: bool


def check_goal(goal: TrajectoryGoal, facts: JointFacts, accepted: Acceptance, now: float) -> JointTrajectory:
    """The goal's trajectory with its joints in the controller's order.

    Raises:
        GoalRejected: see `JointTrajectoryController.send_goal`.
    """
    trajectory = goal.trajectory
    if not isinstance(trajectory, JointTrajectory):
        raise GoalRejected("CTRL129", f"the goal is a {type(trajectory).__name__}; expected a JointTrajectory")
    names = _check_joints(trajectory, facts, accepted)
    if trajectory.integrated and not accepted.allow_integration_in_goal_trajectories:
        message = "the trajectory has points without positions, and integrating them is not allowed"
        hint = "give positions, or set allow_integration_in_goal_trajectories: true"
        raise GoalRejected("CTRL126", message, hint=hint)
    if trajectory.efforts is not None and not accepted.efforts:
        message = "the trajectory has efforts, but the controller commands no effort"
        raise GoalRejected("CTRL127", message, hint="remove them, or add effort to command_interfaces")
    if not math.isfinite(goal.start_time) or goal.start_time < 0.0:
        raise GoalRejected("CTRL128", f"the start time is {goal.start_time} s; expected 0 or more")
    if goal.start_time > 0.0 and goal.start_time + trajectory.duration < now:
        end = goal.start_time + trajectory.duration
        message = f"the trajectory ends at t = {end:.3f} s, {now - end:.3f} s ago"
        raise GoalRejected("CTRL128", message, hint="omit the start time to begin now")
    ordered = trajectory.of_joints(names)
    own = facts.some(names)
    _check_limits(ordered, own)
    _check_end(ordered, own, accepted)
    return ordered


def _check_joints(trajectory: JointTrajectory, facts: JointFacts, accepted: Acceptance) -> tuple[str, ...]:
    """The joints of a trajectory, in the order of the controller."""
    for name in trajectory.names:
        if name not in facts.joints:
            raise GoalRejected(
                "CTRL120",
                f"joint '{name}' is not a joint of the controller: {', '.join(facts.joints)}",
                hint=did_you_mean(name, facts.joints, kind="joints"),
                error_code=ErrorCode.INVALID_JOINTS,
            )
    left_out = [name for name in facts.joints if name not in trajectory.names]
    if left_out and not accepted.allow_partial_joints_goal:
        raise GoalRejected(
            "CTRL121",
            f"the trajectory has no values for joint '{left_out[0]}'",
            hint="give all joints, or set allow_partial_joints_goal: true",
            error_code=ErrorCode.INVALID_JOINTS,
        )
    return tuple(name for name in facts.joints if name in trajectory.names)


def _check_end(trajectory: JointTrajectory, facts: JointFacts, accepted: Acceptance) -> None:
    if trajectory.velocities is None or accepted.allow_nonzero_velocity_at_trajectory_end or trajectory.source:
        return
    last = trajectory.velocities[-1]
    j = int(np.argmax(np.abs(last)))
    if abs(last[j]) > REST:
        message = f"the trajectory ends with joint '{facts.joints[j]}' at {last[j]:.6g} {facts.units[j]}/s, not at rest"
        hint = "end at rest, or set allow_nonzero_velocity_at_trajectory_end: true"
        raise GoalRejected("CTRL123", message, hint=hint)


def _check_limits(trajectory: JointTrajectory, facts: JointFacts) -> None:
    if trajectory.source is None:  # otherwise the positions are not known yet
        positions = trajectory.positions
        beyond = (positions < facts.lower - POSITION_SLACK) | (positions > facts.upper + POSITION_SLACK)
        if beyond.any():
            k, j = (int(index) for index in np.argwhere(beyond)[0])
            raise GoalRejected("CTRL124", _beyond(facts, j, float(positions[k, j]), f"point {k}"))
    if trajectory.velocities is not None:
        _check_speeds(trajectory.velocities, np.arange(len(trajectory.times)), facts, "at point")
    if trajectory.interpolation == "splines":
        straight = np.flatnonzero(np.minimum(trajectory.order_of_points[:-1], trajectory.order_of_points[1:]) == LINEAR)
        slopes = np.diff(trajectory.positions, axis=0)[straight] / np.diff(trajectory.times)[straight, None]
        _check_speeds(slopes, straight + 1, facts, "on the path to point")


def _check_speeds(velocities: Array, points: npt.NDArray[np.intp], facts: JointFacts, what: str) -> None:
    """
    Raises:
        GoalRejected: a velocity (K, n) is above its limit; names the point (K) that it belongs to.
    """
    fast = np.abs(velocities) > facts.velocity * (1.0 + VELOCITY_SLACK)
    if fast.any():
        k, j = (int(index) for index in np.argwhere(fast)[0])
        raise too_fast(facts, j, float(velocities[k, j]), f"{what} {points[k]}")


def too_fast(facts: JointFacts, j: int, velocity: float, where: str) -> GoalRejected:
    """The rejection of a goal with a `velocity` of joint `j` beyond its limit."""
    unit = facts.units[j] + "/s"
    most = float(facts.velocity[j])
    moves, limit = distinguished(velocity, most if velocity > 0.0 else -most, form=".6g")
    return GoalRejected(
        "CTRL125",
        f"joint '{facts.joints[j]}' moves at {moves} {unit} {where}; its limit is {limit.removeprefix('-')} {unit}",
    )


def _beyond(facts: JointFacts, j: int, value: float, where: str) -> str:
    unit = facts.units[j]
    (low, there), (also, high) = (
        distinguished(facts.lower[j], value, form=".6g"),
        distinguished(value, facts.upper[j], form=".6g"),
    )
    return (
        f"joint '{facts.joints[j]}' is at {max(there, also, key=len)} {unit} at {where}; "
        f"its limits are {low} to {high} {unit}"
    )


def outside_limits(positions: Array, facts: JointFacts, period: float) -> str | None:
    """The first violation of a position limit in (T, n) references of consecutive ticks; None if there is none.

    Curves can overshoot between waypoints within the limits; the slack here is ten times as large for that reason.
    """
    slack = 10.0 * POSITION_SLACK
    if not ((positions.min(axis=0) < facts.lower - slack) | (positions.max(axis=0) > facts.upper + slack)).any():
        return None
    k, j = (int(i) for i in np.argwhere((positions < facts.lower - slack) | (positions > facts.upper + slack))[0])
    return _beyond(facts, j, float(positions[k, j]), f"{k * period:.3f} s into the goal")


def shortest(error: Array, facts: JointFacts) -> None:
    """Reduce errors (n) of continuous joints to the shortest angles, in place; at half a turn the sign is kept."""
    turns = np.ceil(np.abs(error) / math.tau - 0.5)
    error -= facts.continuous * math.tau * np.copysign(np.maximum(turns, 0.0), error)


COMMANDED: Final[tuple[tuple[Interface, ...], ...]] = (
    ("position",),
    ("position", "velocity"),
    ("position", "velocity", "acceleration"),
    ("velocity",),
    ("effort",),
    ("position", "effort"),
)
READ: Final[tuple[tuple[Interface, ...], ...]] = COMMANDED[:3]


def controlled_by_error(command_interfaces: Sequence[str]) -> bool:
    """Whether a PID computes the command: only a velocity or only an effort."""
    return tuple(command_interfaces) in {("velocity",), ("effort",)}


def refused(command_interfaces: Sequence[str], state_interfaces: Sequence[str]) -> tuple[str, str] | None:
    """The problem with these interfaces, and a hint; None if they are valid."""
    for what, given, legal in (("command", command_interfaces, COMMANDED), ("state", state_interfaces, READ)):
        for interface in given:
            if interface not in get_args(Interface):
                known = get_args(Interface)
                return f"unknown {what} interface '{interface}'", did_you_mean(
                    interface, known, kind="interfaces"
                ) or ""
        if len(set(given)) < len(given) or set(given) not in [set(allowed) for allowed in legal]:
            sets = "; ".join(f"[{', '.join(allowed)}]" for allowed in legal)
            return f"{what}_interfaces [{', '.join(given)}] are not supported together", f"use one of {sets}"
    if "velocity" not in state_interfaces and (
        controlled_by_error(command_interfaces) or "effort" in command_interfaces
    ):
        message = f"state_interfaces [{', '.join(state_interfaces)}] lack the velocity, which commands of "
        return message + f"[{', '.join(command_interfaces)}] need", "set state_interfaces: [position, velocity]"
    return None
