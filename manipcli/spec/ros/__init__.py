"""Rewriting of ROS controllers files to our form before validation; every value keeps its place.

ROS 1: `arm_controller: {type: effort_controllers/JointTrajectoryController, joints, gains, constraints}`, also inside
namespaces. ROS 2: `controller_manager: {ros__parameters: {arm_controller: {type: ...}}}` and
`arm_controller: {ros__parameters: {joints, command_interfaces, gains, constraints}}`, also inside namespaces and
wildcards (`/**:`), and with dotted keys (`gains.joint_1.p: 3`).

`tables.py` lists the parameters of ROS for each type of controller. A parameter that our spec has is passed on; other
ROS parameters are left out with a warning. An unknown parameter is an error.
"""

from manipcli.spec.ros.rewrite import rewrite

__all__ = ["rewrite"]
