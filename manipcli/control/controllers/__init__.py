"""Registry of controller types."""

from typing import Any

from manipcli.control.controller import ControllerMember
from manipcli.control.controllers import (
    cartesian_impedance,
    computed_torque,
    force_torque_broadcaster,
    forward_command,
    gripper,
    joint_state_broadcaster,
    joint_trajectory,
    pid,
)
from manipcli.core.registry import Seam

CONTROLLERS: Seam[ControllerMember[Any]] = Seam(
    kind="controller",
    members=(
        joint_trajectory.MEMBER,
        gripper.MEMBER,
        computed_torque.MEMBER,
        cartesian_impedance.MEMBER,
        forward_command.MEMBER,
        pid.MEMBER,
        joint_state_broadcaster.MEMBER,
        force_torque_broadcaster.MEMBER,
    ),
)
