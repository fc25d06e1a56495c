"""Specs of ROS messages on trajectories: JointTrajectory, its points and durations, and JointTolerance."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import JointAcceleration, JointValue, JointVelocity, Time


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


class ToleranceSpec(Model):
    """control_msgs/JointTolerance: above 0 a tolerance, 0 the controller's own, -1 none."""

    name: str = Field(description="The joint.")
    position: float = Field(0.0, description="Of the position [rad or m]. Default 0: the controller's.")
    velocity: float = Field(0.0, description="Of the velocity [rad/s or m/s]. Default 0: the controller's.")
    acceleration: float = Field(0.0, description="Of the acceleration [rad/s^2 or m/s^2]. Default 0: none.")

    @model_validator(mode="after")
    def _known_values(self) -> ToleranceSpec:
        for key in ("position", "velocity", "acceleration"):
            value = getattr(self, key)
            if value < 0.0 and value != -1.0:
                raise problem("range", f"must be 0 or more, or -1 (not enforced), not {value:g}", at=(key,))
        return self


class TrajectorySpec(Model):
    """trajectory_msgs/JointTrajectory."""

    header: dict[str, Any] = Field({}, description="Ignored, so that a message can be pasted.")
    joint_names: tuple[str, ...] = Field(min_length=1, description="The joints that move.")
    points: tuple[PointSpec, ...] = Field(min_length=1, description="In the order of their times; the last at rest.")

    @model_validator(mode="after")
    def _sizes(self) -> TrajectorySpec:
        check_sizes(self.joint_names, self.points)
        return self


def check_sizes(joint_names: tuple[str, ...], points: tuple[PointSpec, ...]) -> None:
    """
    Raises:
        PydanticCustomError: no point, duplicate joints, wrong numbers of values, times that do not increase, or an end
            in motion.
    """
    if not points:
        raise problem("count", "the trajectory has no points", at=("points",))
    n, before, last = len(joint_names), -1.0, len(points) - 1
    for k, name in enumerate(joint_names):
        if name in joint_names[:k]:
            raise problem("duplicate", f"duplicate joint '{name}'", at=("joint_names", k))
    for k, point in enumerate(points):
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
    for k, v in enumerate(points[-1].velocities):
        if v != 0.0:
            message = f"the last point must be at rest; its velocity of {joint_names[k]} is not 0"
            raise problem("conflict", message, at=("points", last, "velocities", k))
