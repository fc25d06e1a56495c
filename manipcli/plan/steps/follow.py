"""`follow`: follow a JointTrajectory, or a FollowJointTrajectory goal, in the form of a ROS message.

- follow:
    joint_names: [joint_1, joint_2]
    points:
      - {positions: [0, 0], velocities: [0, 0], time_from_start: {secs: 3}}
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem
from manipcli.core.errors import Loc, NotPlannable
from manipcli.core.prose import amount
from manipcli.core.text import did_you_mean, number_of
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unfollowed
from manipcli.plan.clauses import joint_values
from manipcli.plan.limit_check import verify_written
from manipcli.plan.motion import GoalTolerances, JointTolerance, PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.trajectory import CUBIC, QUINTIC, JointTrajectory, TrajectoryPoint
from manipcli.plan.unknown_names import unknown_joint
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.names import JointName
from manipcli.spec.quantity import Time
from manipcli.spec.trajectory_message import DurationSpec, PointSpec, ToleranceSpec, TrajectorySpec, check_sizes

HERE = 1e-3
"""[rad or m] A first point at 0 s that is nearer to the robot's position counts as equal: messages are rounded."""


class FollowSpec(Model):
    """Follow a trajectory_msgs/JointTrajectory, or a goal of FollowJointTrajectory, in the form of the ROS message.

    Between two points the curve is linear, cubic or quintic, by what both give. The robot moves to the first point from
    its position, at rest; continuous joints take the shortest rotation. Position and velocity limits apply to every
    curve. A linear curve has infinite acceleration at its points and a cubic one infinite jerk, so those limits apply
    only to curves that can keep them. With `retime` all of them apply, and times, velocities and accelerations of the
    points have no effect.
    """

    header: dict[str, Any] = Field({}, description="Ignored, so that a message can be pasted.")
    joint_names: tuple[JointName, ...] = Field((), description="The joints that move.")
    points: tuple[PointSpec, ...] = Field((), description="In the order of their times; the last at rest.")
    retime: bool = Field(
        False,
        description="Whether only the positions count: a smooth curve through them is timed as fast as the limits of "
        "velocity, acceleration, jerk and effort allow. Default false.",
    )
    trajectory: TrajectorySpec | None = Field(
        None, description="Instead of `joint_names` and `points`: those of a FollowJointTrajectory goal."
    )
    path_tolerance: tuple[ToleranceSpec, ...] | None = Field(
        None, description="Tolerances by joint on the way. Default: the controller's."
    )
    goal_tolerance: tuple[ToleranceSpec, ...] | None = Field(
        None, description="Tolerances by joint at the end. Default: the controller's."
    )
    goal_time_tolerance: Time | DurationSpec | None = Field(
        None, description="Extra time to reach the goal; -1: unlimited. Default, or 0: the controller's."
    )

    multi_dof_trajectory: dict[str, Any] | None = Field(None, description="Must have no points.")
    component_path_tolerance: tuple[()] | None = Field(None, description="Must be empty.")
    component_goal_tolerance: tuple[()] | None = Field(None, description="Must be empty.")

    @model_validator(mode="after")
    def _one_form(self) -> FollowSpec:
        if self.trajectory is None:
            if not self.joint_names:
                raise problem("conflict", "the key 'joint_names' is missing", hint="or `trajectory`, of a ROS goal")
            check_sizes(self.joint_names, self.points)
        elif self.joint_names or self.points:
            key = "joint_names" if self.joint_names else "points"
            message = f"'{key}' is given next to 'trajectory', which has its own"
            raise problem("conflict", message, at=(key,), key=True)
        if (self.multi_dof_trajectory or {}).get("points"):
            raise problem("conflict", "poses of several axes are not supported", at=("multi_dof_trajectory",), key=True)
        return self

    @property
    def message(self) -> tuple[tuple[str, ...], tuple[PointSpec, ...], Loc]:
        """The joints and points of either form, and where they are."""
        if self.trajectory is None:
            return self.joint_names, self.points, ()
        return self.trajectory.joint_names, self.trajectory.points, ("trajectory",)

    @property
    def tolerances(self) -> GoalTolerances | None:
        """The tolerances of the goal; None if it has none."""
        time = self.goal_time_tolerance
        seconds = time.seconds if isinstance(time, DurationSpec) else time or 0.0
        if not (self.path_tolerance or self.goal_tolerance or seconds):
            return None
        return GoalTolerances(_joints(self.path_tolerance or ()), _joints(self.goal_tolerance or ()), seconds)


def _joints(tolerances: Sequence[ToleranceSpec]) -> tuple[JointTolerance, ...]:
    return tuple(JointTolerance(own.name, own.position, own.velocity, own.acceleration) for own in tolerances)


def plan(spec: FollowSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """The points as given, from the state on; those of continuous joints shifted by whole turns to be near it.

    Raises:
        NotPlannable: a limit is exceeded (names joint, value, limit and time), a body is in the way, or a first point
            at 0 s is not the robot's position.
    """
    names, given, at = spec.message
    start = state.position[planner.robot.indices(names)]
    for k, point in enumerate(given):
        written = [(names[i], value, (*at, "points", k, "positions", i)) for i, value in enumerate(point.positions)]
        verify_written(planner.robot, written, when=f" at t = {point.seconds:.3f} s")
    first = np.array(given[0].positions)
    endless = [planner.robot.joint(name).type == "continuous" for name in names]
    turns = np.where(endless, math.tau * np.round((first - start) / math.tau), 0.0)
    first = first - turns
    points = [
        TrajectoryPoint(np.array(point.positions) - turns, point.seconds, point.velocities, point.accelerations)
        for point in given
    ]
    builder = MotionBuilder(planner, state, verb="follow")
    if spec.retime:
        builder.through("follow", names, np.vstack([start, *(np.asarray(point.positions) for point in points)]))
        return _with_tolerances(builder.plan(), spec.tolerances)
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
    return _with_tolerances(builder.plan(), spec.tolerances)


def _with_tolerances(made: StepPlan, tolerances: GoalTolerances | None) -> StepPlan:
    """The plan with these tolerances of its goals."""
    return replace(made, motions=tuple(replace(motion, tolerances=tolerances) for motion in made.motions))


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
    """Unknown joints; tolerances of joints that the trajectory does not have."""
    names, _, at = spec.message
    found = [problem for k, name in enumerate(names) for problem in unknown_joint(robot, name, (*at, "joint_names", k))]
    for key in ("path_tolerance", "goal_tolerance"):
        for k, own in enumerate(getattr(spec, key) or ()):
            if own.name not in names:
                message = f"joint '{own.name}' is not in the trajectory"
                found.append(Problem((key, k, "name"), message, did_you_mean(own.name, names, kind="its joints")))
    return tuple(found)


def uncommanded(spec: FollowSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """Joints of two controllers, or joints of the hand."""
    names, _, at = spec.message
    return unfollowed(claims, names, (*at, "joint_names"))


def clause(spec: FollowSpec, robot: RobotModel) -> str:
    names, points, _ = spec.message
    timed = "as fast as the limits allow" if spec.retime else f"in {amount(points[-1].seconds, 's')}"
    end = joint_values(robot, names, points[-1].positions)
    return f"follow a trajectory of {number_of(len(points), 'point')} {timed}, until {end}"


MEMBER = StepMember(
    name="follow",
    spec=FollowSpec,
    candidates=single(plan),
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    part=lambda *_: "arm",
)
