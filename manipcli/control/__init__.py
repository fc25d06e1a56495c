"""Controllers, their manager, PID, joint limits and goals; independent of the physics engine."""

from manipcli.control.action import ErrorCode, Feedback, GoalHandle, GoalRejected, GoalResult, GripperGoal
from manipcli.control.controller import Controller, ControllerOutput, JointState
from manipcli.control.controllers.computed_torque import ComputedTorqueController
from manipcli.control.controllers.force_torque_broadcaster import ForceTorqueBroadcaster
from manipcli.control.controllers.forward_command import ForwardCommandController
from manipcli.control.controllers.gripper import GripperController
from manipcli.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.controllers.pid import PidController
from manipcli.control.impedance_controller import CartesianImpedanceController
from manipcli.control.limit_laws import limit_acceleration, limit_effort, limit_position, limit_velocity
from manipcli.control.limiter import JointLimiter, NotFinite
from manipcli.control.manager import ControllerManager
from manipcli.control.pid import Pid
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.plan.motion import JointTolerance
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, JointConstraintSpec

__all__ = [
    "CartesianImpedanceController",
    "ComputedTorqueController",
    "ConstraintsSpec",
    "Controller",
    "ControllerManager",
    "ControllerOutput",
    "ErrorCode",
    "Feedback",
    "ForceTorqueBroadcaster",
    "ForwardCommandController",
    "GainsSpec",
    "GoalHandle",
    "GoalRejected",
    "GoalResult",
    "GripperController",
    "GripperGoal",
    "JointConstraintSpec",
    "JointLimiter",
    "JointState",
    "JointStateBroadcaster",
    "JointTolerance",
    "JointTrajectory",
    "JointTrajectoryController",
    "NotFinite",
    "Pid",
    "PidController",
    "TrajectoryGoal",
    "TrajectoryPoint",
    "limit_acceleration",
    "limit_effort",
    "limit_position",
    "limit_velocity",
]
