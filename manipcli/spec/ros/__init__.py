"""ROS's own forms of the controllers file, rewritten to ours before validation; every value keeps its place.

ROS 1: `arm_controller: {type: effort_controllers/JointTrajectoryController, joints, gains, constraints}`, also below
names of namespaces. ROS 2: `controller_manager: {ros__parameters: {arm_controller: {type: ...}}}` and
`arm_controller: {ros__parameters: {joints, command_interfaces, gains, constraints}}`, also below namespaces, wildcards
(`/**:`) and with dots (`gains.joint_1.p: 3`).

What ROS knows stands in tables, one a type of controller; what of it the spec of the controller has is passed on, the
rest is left out with a warning. What nobody knows is an error.
"""

from manipcli.spec.ros.rewrite import rewrite

__all__ = ["rewrite"]
