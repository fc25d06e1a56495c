"""`at_pose`: the robot is in one of its named poses."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.model.condition import Condition, Problem, World
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.spec.base import Model
from manipcli.spec.quantity import Angle


class AtPoseSpec(Model):
    """Every rotating joint of the pose (of its `group`, when one is given) is at most `within` from its value there."""

    pose: str = Field(description="A named pose of the robot.")
    group: str | None = Field(default=None, description="Only this group's joints; default: all that the pose names.")
    within: Annotated[Angle, Field(gt=0)] = Field(default=0.02, description="Largest difference of a joint [rad].")


def margin(spec: AtPoseSpec, world: World, state: WorldState) -> Array:
    """`within` minus the largest |q - q_pose| [rad] (...) over the joints."""
    joints, wanted = _targets(spec, world.robot)
    difference = np.abs(state.position[..., world.robot.indices(joints)] - np.array(wanted))
    return np.asarray(spec.within - np.max(difference, axis=-1))


def _targets(spec: AtPoseSpec, robot: RobotModel) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """The joints that are compared, and their values in the pose."""
    pose = robot.pose(spec.pose)
    wanted = None if spec.group is None else frozenset(robot.group(spec.group).joints)
    pairs = [pair for pair in zip(pose.joints, pose.positions, strict=True) if wanted is None or pair[0] in wanted]
    return tuple(name for name, _ in pairs), tuple(value for _, value in pairs)


def check(spec: AtPoseSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Pose and group exist, have joints in common, and these rotate (an angle cannot bound what slides)."""
    problems = []
    poses, groups = [pose.name for pose in robot.poses], [group.name for group in robot.groups]
    if spec.pose not in poses:
        message = f"'{spec.pose}' is not a pose of robot '{robot.name}'"
        problems.append(Problem(("pose",), message, did_you_mean(spec.pose, poses)))
    if spec.group is not None and spec.group not in groups:
        message = f"'{spec.group}' is not a group of robot '{robot.name}'"
        problems.append(Problem(("group",), message, did_you_mean(spec.group, groups)))
    if problems:
        return tuple(problems)
    joints, _ = _targets(spec, robot)
    if not joints:
        problems.append(Problem(("group",), f"pose '{spec.pose}' says nothing of group '{spec.group}'"))
    for name in joints:
        if robot.joint(name).type == "prismatic":
            message = f"joint '{name}' of pose '{spec.pose}' slides, and `within` is an angle"
            problems.append(Problem(("pose",), message, "name a `group` without it"))
    return tuple(problems)


AT_POSE = Condition(
    name="at_pose",
    spec=AtPoseSpec,
    unit="rad",
    margin=margin,
    bodies=lambda spec, scene: (),
    check=check,
)
