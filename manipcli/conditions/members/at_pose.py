"""`at_pose`: the robot is in one of its named poses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_group
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import wrapped
from manipcli.core.prose import amount, named
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.description.elements import Joint
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import GroupName, PoseName
from manipcli.spec.quantity import AngleTolerance, Length

SLIDE: Final = 0.005
"""[m] Default tolerance of prismatic joints."""


class AtPoseSpec(Model):
    """Every joint of the pose (or of `group`) is at most `within` from its value in the pose, a prismatic joint at most
    `slide`."""

    pose: PoseName = Field(description="A named pose of the robot.")
    group: GroupName | None = Field(
        default=None, description="Only joints of this group. Default: all joints of the pose."
    )
    within: AngleTolerance = Field(default=0.02, description="Largest difference [rad], to pi. Default 0.02.")
    slide: Annotated[Length, Field(gt=0)] | None = Field(
        default=None,
        description="Largest difference of prismatic joints [m]. Default: 5 mm for joints that move the tool; others, "
        "such as fingers, are not compared.",
    )


def monitor(spec: AtPoseSpec, world: World) -> Monitor:
    """`within` minus the largest |q - q_pose| [rad], or `slide` minus that of prismatic joints [m]; the lesser.

    The difference of a continuous joint is wrapped to +-pi.
    """
    turning, sliding = _targets(spec, world.robot)
    bounds = (("rad", spec.within, turning), ("m", spec.slide or SLIDE, sliding))
    parts = [_part(spec.pose, world.robot, *bound) for bound in bounds if bound[-1]]

    def look(window: StateWindow) -> Robustness:
        return least([part(window) for part in parts])

    return look


def _part(pose: str, robot: RobotModel, unit: str, most: float, wanted: Mapping[str, float]) -> Monitor:
    joints, goal = tuple(wanted), np.array(list(wanted.values()))
    columns = robot.indices(joints)
    endless = np.array([robot.joint(name).type == "continuous" for name in joints], dtype=bool)

    def look(window: StateWindow) -> Robustness:
        off = window.states.position[:, columns] - goal
        off[:, endless] = wrapped(off[:, endless])
        away = np.abs(off)

        def describe(k: int) -> str:
            worst = int(np.argmax(away[k]))
            far = readable(float(away[k, worst]), unit)
            return f"joint '{joints[worst]}' is {far} from pose '{pose}'; within {readable(most, unit)}"

        return robustness(most - np.max(away, axis=-1), window.times, unit=unit, scale=most, describe=describe)

    return look


def _targets(spec: AtPoseSpec, robot: RobotModel) -> tuple[dict[str, float], dict[str, float]]:
    """The compared joints and their values in the pose: (revolute, prismatic)."""
    pose = robot.pose(spec.pose)
    asked = pose.joints if spec.group is None else robot.group(spec.group).joints
    turning, sliding = {}, {}
    for name, value in zip(pose.joints, pose.positions, strict=True):
        joint = robot.joint(name)
        if name in asked and joint.type != "prismatic":
            turning[name] = value
        elif name in asked and (spec.slide is not None or _carries_tool(robot, joint)):
            sliding[name] = value
    return turning, sliding


def _carries_tool(robot: RobotModel, joint: Joint) -> bool:
    return robot.tool is not None and robot.tool.link in robot.descendants(joint.child)


def check(spec: AtPoseSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown pose or group, or no joint to compare."""
    robot = context.robot
    problems = []
    poses = [pose.name for pose in robot.poses]
    if spec.pose not in poses:
        message = f"'{spec.pose}' is not a pose of robot '{robot.name}'"
        problems.append(Problem(("pose",), message, did_you_mean(spec.pose, poses)))
    problems += unknown_group(robot, spec.group, ("group",))
    if problems:
        return tuple(problems)
    if not any(_targets(spec, robot)):
        of, loc = ("", "pose") if spec.group is None else (f" of group '{spec.group}'", "group")
        slides = any(_targets(spec.model_copy(update={"slide": SLIDE}), robot))
        hint = "give a tolerance for prismatic joints: `slide: 2 mm`" if slides else None
        kind = "revolute joint" if slides else "joint"
        problems.append(Problem((loc,), f"pose '{spec.pose}' has no {kind}{of}", hint))
    return tuple(problems)


def clause(spec: AtPoseSpec, robot: RobotModel) -> str:
    who = "the robot" if spec.group is None else f"the group {named(spec.group)}"
    slide = "" if spec.slide is None else f", and {amount(spec.slide, 'm')} of sliding joints"
    return f"{who} is in the pose {named(spec.pose)}, each joint within {amount(spec.within, 'rad')}{slide}"


AT_POSE = Condition(
    name="at_pose",
    spec=AtPoseSpec,
    units=("rad", "m"),
    open=monitor,
    check=check,
    absent=lambda spec, world: None,
    clause=clause,
    example="at_pose: {pose: home, within: 2 deg}",
)
