"""Knows joints and references, not physics: controllers, their manager, PID, limits, and the goals they take."""

from manipcli.control.action import ErrorCode, Feedback, GoalHandle, GoalResult, GripperGoal
from manipcli.control.controller import Controller, ControllerOutput, JointState
from manipcli.control.controllers.gripper import GripperController
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.limiter import JointLimiter, NotFinite
from manipcli.control.limits import limit_acceleration, limit_effort, limit_position, limit_velocity
from manipcli.control.manager import ControllerManager
from manipcli.control.pid import Pid
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint

__all__ = [
    "Controller",
    "ControllerManager",
    "ControllerOutput",
    "ErrorCode",
    "Feedback",
    "GoalHandle",
    "GoalResult",
    "GripperController",
    "GripperGoal",
    "JointLimiter",
    "JointState",
    "JointTrajectory",
    "JointTrajectoryController",
    "NotFinite",
    "Pid",
    "TrajectoryPoint",
    "limit_acceleration",
    "limit_effort",
    "limit_position",
    "limit_velocity",
]
