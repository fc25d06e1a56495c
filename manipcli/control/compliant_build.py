"""Controllers that compliant steps bring along: the felt force, and the compliant controller of the arm.

They are made from the controllers file: the arm's compliant controller commands what its trajectory follower commands.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from manipcli.conditions.sensed import FELT
from manipcli.control.compliant_arm import CompliantArm
from manipcli.control.controller import BuildContext, Controller
from manipcli.control.felt_force import FeltForce
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import arm_joints
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.controllers_file import ControllersSpec


@dataclass(frozen=True, slots=True)
class CompliantJoints:
    """The arm that complies: its joints from base to tool, and the follower of their trajectories in the file."""

    joints: tuple[str, ...]
    follower: str
    spec: ControllerSpec


def compliant_joints(file: ControllersSpec, robot: RobotModel) -> CompliantJoints | None:
    """The arm of a robot; None where the robot has no tool, or no follower moves all joints from the base to it."""
    hand = [name for own in file.controllers.values() if own.role == "hand" for name in own.joints]
    joints = arm_joints(robot, hand)
    followers = [(name, own) for name, own in file.controllers.items() if own.role == "follower"]
    for name, own in sorted(followers, key=lambda each: not each[1].active):
        if joints and set(joints) <= set(own.joints):
            return CompliantJoints(joints, name, own)
    return None


def unused(name: str, taken: Collection[str]) -> str:
    """`name`, with an underscore appended until it is not `taken`."""
    while name in taken:
        name += "_"
    return name


def compliant_controllers(file: ControllersSpec, context: BuildContext) -> tuple[Controller, ...]:
    """The felt force, which is active, and the compliant controller, which is not; none where no arm can comply."""
    robot = context.robot
    arm = compliant_joints(file, robot)
    if arm is None or robot.tool is None:
        return ()
    link, X_LT = robot.tool.link, robot.tool.X_LT
    felt = FeltForce(name=FELT, kinematics=context.kinematics(), arm=arm.joints, link=link, offset=X_LT)
    name = unused(f"{arm.follower}_compliant", file.controllers)
    return felt, CompliantArm(name, arm.joints, felt, link, X_LT, context)
