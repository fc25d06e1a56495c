"""Knows joints and references, not physics: controllers, their manager, PID, limits, and the goals they take."""

from manipcli.control.action import ErrorCode, Feedback, GoalHandle, GoalRejected, GoalResult, GripperGoal
from manipcli.control.controller import Controller, ControllerOutput, JointState
from manipcli.control.controllers.gripper import GripperController
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.limiter import JointLimiter, NotFinite
from manipcli.control.limits import limit_acceleration, limit_effort, limit_position, limit_velocity
from manipcli.control.manager import ControllerManager
from manipcli.control.pid import Pid
from manipcli.control.trajectory_goal import JointTolerance, TrajectoryGoal
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, JointConstraintSpec

__all__ = [
    "ConstraintsSpec",
    "Controller",
    "ControllerManager",
    "ControllerOutput",
    "ErrorCode",
    "Feedback",
    "GainsSpec",
    "GoalHandle",
    "GoalRejected",
    "GoalResult",
    "GripperController",
    "GripperGoal",
    "JointConstraintSpec",
    "JointLimiter",
    "JointState",
    "JointTolerance",
    "JointTrajectory",
    "JointTrajectoryController",
    "NotFinite",
    "Pid",
    "TrajectoryGoal",
    "TrajectoryPoint",
    "limit_acceleration",
    "limit_effort",
    "limit_position",
    "limit_velocity",
]
