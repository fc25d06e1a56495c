"""`follow`: follow a JointTrajectory in the form of a ROS message.

- follow:
    joint_names: [joint_1, joint_2]
    points:
      - {positions: [0, 0], velocities: [0, 0], time_from_start: {secs: 3}}
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem
from manipcli.core.errors import NotPlannable
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unfollowed
from manipcli.plan.limit_check import verify_written
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.trajectory import CUBIC, QUINTIC, JointTrajectory, TrajectoryPoint
from manipcli.plan.unknown_names import unknown_joint
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import JointAcceleration, JointValue, JointVelocity, Time

HERE = 1e-3
"""[rad or m] A first point at 0 s that is nearer to the robot's position counts as equal: messages are rounded."""


class DurationSpec(Model):
    """A duration with the fields of ROS 1 (`secs`, `nsecs`) or ROS 2 (`sec`, `nanosec`)."""

    secs: Annotated[int, Field(ge=0, description="Whole seconds, in ROS 1.")] = 0
    nsecs: Annotated[int, Field(ge=0, lt=1_000_000_000, description="Nanoseconds beside them, in ROS 1.")] = 0
    sec: Annotated[int, Field(ge=0, description="Whole seconds, in ROS 2.")] = 0
    nanosec: Annotated[int, Field(ge=0, lt=1_000_000_000, description="Nanoseconds beside them, in ROS 2.")] = 0

    @model_validator(mode="after")
    def _one_spelling(self) -> DurationSpec:
        first, second = self.model_fields_set & {"secs", "nsecs"}, self.model_fields_set & {"sec", "nanosec"}
        if any(getattr(self, word) for word in first) and any(getattr(self, word) for word in second):
            word = min(second)
            message = f"'{min(first)}' is a field of ROS 1, '{word}' a field of ROS 2; use those of one of them"
            raise problem("conflict", message, at=(word,), key=True)
        return self

    @property
    def seconds(self) -> float:
        return self.secs + self.sec + 1e-9 * (self.nsecs + self.nanosec)


class PointSpec(Model):
    """One point; the curve between two points is linear, cubic or quintic, by what both give."""

    positions: tuple[JointValue, ...] = Field(description="One for each joint, in the order of `joint_names`.")
    velocities: tuple[JointVelocity, ...] = Field((), description="One for each joint, or none.")
    accelerations: tuple[JointAcceleration, ...] = Field((), description="One for each joint, or none.")
    effort: tuple[()] = Field((), description="Must be empty.")
    time_from_start: Time | DurationSpec = Field(
        description="From the start of the trajectory, later than the point before."
    )

    @property
    def seconds(self) -> float:
        """`time_from_start` [s]."""
        t = self.time_from_start
        return t.seconds if isinstance(t, DurationSpec) else t


class FollowSpec(Model):
    """Follow a trajectory_msgs/JointTrajectory, in the form of the ROS message.

    Between two points the curve is linear, cubic or quintic, by what both give. The robot moves to the first point from
    its position, at rest; continuous joints take the shortest rotation. Position and velocity limits apply to every
    curve. A linear curve has infinite acceleration at its points and a cubic one infinite jerk, so those limits apply
    only to curves that can keep them. With `retime` all of them apply, and times, velocities and accelerations of the
    points have no effect.
    """

    header: dict[str, Any] = Field({}, description="Ignored, so that a message can be pasted.")
    joint_names: tuple[str, ...] = Field(min_length=1, description="The joints that move.")
    points: tuple[PointSpec, ...] = Field(min_length=1, description="In the order of their times; the last at rest.")
    retime: bool = Field(
        False,
        description="Whether only the positions count: a smooth curve through them is timed as fast as the limits of "
        "velocity, acceleration, jerk and effort allow. Default false.",
    )

    @model_validator(mode="after")
    def _sizes(self) -> FollowSpec:
        n, before, last = len(self.joint_names), -1.0, len(self.points) - 1
        for k, name in enumerate(self.joint_names):
            if name in self.joint_names[:k]:
                raise problem("duplicate", f"duplicate joint '{name}'", at=("joint_names", k))
        for k, point in enumerate(self.points):
            for word in ("positions", "velocities", "accelerations"):
                values = getattr(point, word)
                if len(values) != n and (values or word == "positions"):
                    raise problem("count", f"{len(values)} {word} for {n} joints", at=("points", k, word))
            if point.accelerations and not point.velocities:
                message = "accelerations need velocities; add velocities"
                raise problem("conflict", message, at=("points", k, "accelerations"))
            at = ("points", k, "time_from_start")
            if point.seconds < 0.0:
                raise problem("range", f"must be 0 or more, not {point.seconds:g} s", at=at)
            if point.seconds <= before:
                message = f"{point.seconds:g} s is not after {before:g} s, the time of the previous point"
                raise problem("conflict", message, at=at)
            before = point.seconds
        if before <= 0.0:
            message = "the last point is at 0 s: the trajectory has no duration"
            raise problem("conflict", message, at=("points", last, "time_from_start"))
        for k, v in enumerate(self.points[-1].velocities):
            if v != 0.0:
                message = f"the last point must be at rest; its velocity of {self.joint_names[k]} is not 0"
                raise problem("conflict", message, at=("points", last, "velocities", k))
        return self


def plan(spec: FollowSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """The points as given, from the state on; those of continuous joints shifted by whole turns to be near it.

    Raises:
        NotPlannable: a limit is exceeded (names joint, value, limit and time), a body is in the way, or a first point
            at 0 s is not the robot's position.
    """
    names = spec.joint_names
    start = state.position[planner.robot.indices(names)]
    for k, point in enumerate(spec.points):
        written = [(names[i], value, ("points", k, "positions", i)) for i, value in enumerate(point.positions)]
        verify_written(planner.robot, written, when=f" at t = {point.seconds:.3f} s")
    first = np.array(spec.points[0].positions)
    endless = [planner.robot.joint(name).type == "continuous" for name in names]
    turns = np.where(endless, math.tau * np.round((first - start) / math.tau), 0.0)
    first = first - turns
    points = [
        TrajectoryPoint(np.array(point.positions) - turns, point.seconds, point.velocities, point.accelerations)
        for point in spec.points
    ]
    builder = MotionBuilder(planner, state, verb="follow")
    if spec.retime:
        builder.through("follow", names, np.vstack([start, *(np.asarray(point.positions) for point in points)]))
        return builder.plan()
    if points[0].time_from_start <= 0.0:
        off = np.abs(first - start)
        worst = int(np.argmax(off))
        if off[worst] > HERE:
            unit = planner.robot.joint(names[worst]).unit
            raise NotPlannable(
                f"the first point, at 0 s, has joint '{names[worst]}' at {first[worst]:.4f} {unit}, "
                f"but the joint is at {start[worst]:.4f} {unit}",
                hint="give the point a later time_from_start, or `move` there first",
            )
        points[0] = replace(points[0], positions=start)
    trajectory = JointTrajectory(names, points, TrajectoryPoint(start))
    builder.follow("follow", trajectory, limits=_limits(planner.robot, trajectory))
    return builder.plan()


def _limits(robot: RobotModel, trajectory: JointTrajectory) -> MotionLimits:
    """The limits that every curve between two points can keep; infinite where a curve cannot."""
    orders = trajectory.orders
    lowest = trajectory.order if orders is None else int(np.minimum(orders[:-1], orders[1:]).min())
    limits = MotionLimits.of(robot, trajectory.names)
    unlimited = np.full(len(trajectory.names), np.inf)
    if lowest < QUINTIC:
        limits = replace(limits, jerk=unlimited)
    return replace(limits, acceleration=unlimited) if lowest < CUBIC else limits


def check(spec: FollowSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown joints."""
    return tuple(
        problem for k, name in enumerate(spec.joint_names) for problem in unknown_joint(robot, name, ("joint_names", k))
    )


def uncommanded(spec: FollowSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """Joints of two controllers, or joints of the hand."""
    return unfollowed(claims, spec.joint_names, ("joint_names",))


MEMBER = StepMember(name="follow", spec=FollowSpec, candidates=single(plan), check=check, uncommanded=uncommanded)
