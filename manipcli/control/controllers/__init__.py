"""The types of controllers."""

from typing import Any

from manipcli.control.controller import ControllerMember
from manipcli.control.controllers import gripper, joint_trajectory
from manipcli.core.registry import Seam

CONTROLLERS: Seam[ControllerMember[Any]] = Seam(kind="controller", members=(joint_trajectory.MEMBER, gripper.MEMBER))
