"""`follow`: a JointTrajectory, written as ROS writes it.

    - follow:
        joint_names: [joint_1, joint_2]
        points:
          - {positions: [0, 0], velocities: [0, 0], time_from_start: {secs: 3}}
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.plan.names import unknown_joint
from manipcli.plan.planner import Draft, Planner
from manipcli.plan.step import Situation, StepMember, StepPlan
from manipcli.spec.base import Model
from manipcli.spec.quantity import JointAcceleration, JointValue, JointVelocity, Time


class DurationSpec(Model):
    """A duration in ROS 1's (`secs`, `nsecs`) or ROS 2's words (`sec`, `nanosec`)."""

    secs: Annotated[int, Field(ge=0)] = 0
    nsecs: Annotated[int, Field(ge=0)] = 0
    sec: Annotated[int, Field(ge=0)] = 0
    nanosec: Annotated[int, Field(ge=0)] = 0

    @property
    def seconds(self) -> float:
        return self.secs + self.sec + 1e-9 * (self.nsecs + self.nanosec)


class PointSpec(Model):
    """One point; the curve between two is linear, cubic or quintic by what both give."""

    positions: tuple[JointValue, ...]
    velocities: tuple[JointVelocity, ...] = ()
    accelerations: tuple[JointAcceleration, ...] = ()
    effort: tuple[()] = ()
    time_from_start: Time | DurationSpec

    @property
    def seconds(self) -> float:
        """`time_from_start` [s]."""
        t = self.time_from_start
        return t.seconds if isinstance(t, DurationSpec) else t


class FollowSpec(Model):
    """The fields of trajectory_msgs/JointTrajectory."""

    header: dict[str, Any] = Field({}, description="Ignored, so that a message can be pasted.")
    joint_names: tuple[str, ...] = Field(min_length=1)
    points: tuple[PointSpec, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _sizes(self) -> FollowSpec:
        n, before = len(self.joint_names), -1.0
        if len(set(self.joint_names)) != n:
            raise ValueError("a joint stands twice in `joint_names`")
        for k, point in enumerate(self.points):
            for word in ("positions", "velocities", "accelerations"):
                values = getattr(point, word)
                if len(values) != n and (values or word == "positions"):
                    raise ValueError(f"point {k}: {len(values)} {word} for {n} joints")
            if point.accelerations and not point.velocities:
                raise ValueError(f"point {k}: accelerations without velocities say no curve; add velocities")
            if point.seconds <= before:
                raise ValueError(f"point {k}: time_from_start {point.seconds:g} s is not after {before:g} s")
            before = point.seconds
        return self


def plan(spec: FollowSpec, planner: Planner, situation: Situation) -> StepPlan:
    """The points as they are, from the situation on; refused where they leave a limit."""
    draft = Draft(planner, situation)
    draft.follow(
        "follow",
        spec.joint_names,
        times=np.array([point.seconds for point in spec.points]),
        positions=np.array([point.positions for point in spec.points]),
        velocities=_all_or_none([point.velocities for point in spec.points]),
        accelerations=_all_or_none([point.accelerations for point in spec.points]),
    )
    return draft.plan()


def _all_or_none(rows: list[tuple[float, ...]]) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """(k, n), or None where some point leaves them out."""
    return np.array(rows) if all(rows) else None


def check(spec: FollowSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown joints."""
    return tuple(
        problem
        for k, name in enumerate(spec.joint_names)
        for problem in unknown_joint(robot, name, ("joint_names", k))
    )


MEMBER = StepMember(name="follow", spec=FollowSpec, plan=plan, check=check)
