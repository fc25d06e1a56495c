"""Controllers that compliant steps bring along: the felt force, and the compliant controller of the arm.

They are made from the controllers file: the arm's compliant controller commands what its trajectory follower commands.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from manipcli.conditions.sensed import FELT
from manipcli.control.compliant_arm import AdmittanceArm, ImpedanceArm
from manipcli.control.controller import BuildContext, Controller
from manipcli.control.felt_force import FeltForce
from manipcli.core.geometry import Transform
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import arm_joints
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.controllers_file import ControllersSpec


@dataclass(frozen=True, slots=True)
class WristSensor:
    """A `force_torque` sensor between the last joint of the arm and the tool, at `X_LS` in `link`."""

    name: str
    link: str
    X_LS: Transform


@dataclass(frozen=True, slots=True)
class CompliantJoints:
    """The arm that complies: its joints from base to tool, and the follower of their trajectories in the file."""

    joints: tuple[str, ...]
    follower: str
    spec: ControllerSpec

    @property
    def efforts(self) -> bool:
        """Whether they take efforts."""
        return self.spec.interfaces == ("effort",)


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


def compliant_controllers(
    file: ControllersSpec, context: BuildContext, wrist: WristSensor | None
) -> tuple[Controller, ...]:
    """The felt force, which is active, and the compliant controller, which is not; none where no arm can comply.

    Args:
        file: the controllers file.
        context: robot and kinematics.
        wrist: measures the felt force; None: it is estimated.
    """
    robot = context.robot
    arm = compliant_joints(file, robot)
    if arm is None or robot.tool is None:
        return ()
    link, X_LT, kinematics = robot.tool.link, robot.tool.X_LT, context.kinematics()
    sensor, X_ST = "", None
    if wrist is not None:
        q = np.zeros(len(robot.joint_names))  # no joint lies between sensor and tool
        X_WS = kinematics.forward(q, wrist.link) @ wrist.X_LS
        sensor, X_ST = wrist.name, X_WS.inverse() @ kinematics.forward(q, link) @ X_LT
    felt = FeltForce(name=FELT, kinematics=kinematics, arm=arm.joints, link=link, offset=X_LT, sensor=sensor, X_ST=X_ST)
    name = unused(f"{arm.follower}_compliant", file.controllers)
    law = ImpedanceArm if arm.efforts else AdmittanceArm
    return felt, law(name, arm.joints, felt, link, X_LT, context)
