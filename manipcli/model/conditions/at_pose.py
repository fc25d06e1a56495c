"""`at_pose`: the robot is in one of its named poses."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.condition import Condition, Gauge, Problem, Setting, World, unknown_group
from manipcli.model.moments import Moments
from manipcli.model.reading import Reading, reading
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.quantity import AngleTolerance


class AtPoseSpec(Model):
    """Every rotating joint of the pose (of its `group`, when one is given) is at most `within` from its value there."""

    pose: str = Field(description="A named pose of the robot.")
    group: str | None = Field(default=None, description="Only this group's joints; default: all that the pose names.")
    within: AngleTolerance = Field(default=0.02, description="Largest difference [rad], to pi. Default 0.02.")


def gauge(spec: AtPoseSpec, world: World) -> Gauge:
    """`within` minus the largest |q - q_pose| [rad] over the joints; those that slide do not count."""
    joints, wanted = _targets(spec, world.robot)
    columns, goal = world.robot.indices(joints), np.array(wanted)

    def look(moments: Moments) -> Reading:
        away = np.abs(moments.states.position[:, columns] - goal)

        def say(k: int) -> str:
            worst = int(np.argmax(away[k]))
            off = readable(float(away[k, worst]), "rad")
            return f"joint '{joints[worst]}' is {off} from pose '{spec.pose}'; within {readable(spec.within, 'rad')}"

        return reading(spec.within - np.max(away, axis=-1), moments.times, unit="rad", scale=spec.within, say=say)

    return look


def _targets(spec: AtPoseSpec, robot: RobotModel) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """The joints that are compared, and their values in the pose; what slides has none that an angle could bound."""
    pose = robot.pose(spec.pose)
    wanted = frozenset(pose.joints if spec.group is None else robot.group(spec.group).joints)
    turning = {name for name in wanted & set(pose.joints) if robot.joint(name).type != "prismatic"}
    pairs = [pair for pair in zip(pose.joints, pose.positions, strict=True) if pair[0] in turning]
    return tuple(name for name, _ in pairs), tuple(value for _, value in pairs)


def check(spec: AtPoseSpec, setting: Setting) -> tuple[Problem, ...]:
    """Pose and group exist, and have joints in common that rotate."""
    robot = setting.robot
    problems = []
    poses = [pose.name for pose in robot.poses]
    if spec.pose not in poses:
        message = f"'{spec.pose}' is not a pose of robot '{robot.name}'"
        problems.append(Problem(("pose",), message, did_you_mean(spec.pose, poses)))
    problems += unknown_group(robot, spec.group, ("group",))
    if problems:
        return tuple(problems)
    joints, _ = _targets(spec, robot)
    if not joints:
        of = "" if spec.group is None else f" of group '{spec.group}'"
        loc = "pose" if spec.group is None else "group"
        problems.append(Problem((loc,), f"pose '{spec.pose}' names no rotating joint{of}, and `within` is an angle"))
    return tuple(problems)


AT_POSE = Condition(
    name="at_pose",
    spec=AtPoseSpec,
    units=("rad",),
    open=gauge,
    check=check,
    absent=lambda spec, world: None,
    example="at_pose: {pose: home, within: 2 deg}",
)
