"""Tables of the parameters of ros_controllers and ros2_controllers, one per type of controller.

Sources: the parameter definitions of ros2_controllers and the source code of ros_controllers.
"""

from __future__ import annotations

import math
from typing import Final

from manipcli.spec.block_fields import bounds_of
from manipcli.spec.quantity import JointTolerance
from manipcli.spec.ros.reshape import forward, joint_trajectory, one_joint, pid
from manipcli.spec.ros.table import Block, Table
from manipcli.spec.ros.unshape import to_forward, to_gripper, to_joint_trajectory, to_pid, to_wrench
from manipcli.spec.source.tree import Plain

_EVERYWHERE: Final = frozenset({"use_sim_time", "publish_state", "state_publish_rate", "publish_rate"})
"""Parameters of publishing and clocks, without effect here: a log has every tick, and time is simulated."""
_ANY: Final = frozenset(
    {"is_async", "async_parameters", "thread_priority", "cpu_affinity", "fallback_controllers", "params_file"}
)
_NEUTRAL: Final[dict[str, tuple[Plain, ...]]] = {
    "is_async": (False,), "fallback_controllers": ([],), "params_file": ([], ""), "cpu_affinity": ([],),
    "update_rate": (0,),
}  # fmt: skip
"""In ROS 2 an update rate of 0 means the rate of the manager."""
_GAINS: Final = Block(
    known=frozenset(
        {
            "p", "i", "d", "i_clamp", "i_clamp_min", "i_clamp_max", "u_clamp_min", "u_clamp_max", "antiwindup",
            "antiwindup_strategy", "tracking_time_constant", "error_deadband", "ff_velocity_scale", "feedforward_gain",
            "normalize_error", "angle_wraparound", "save_i_term", "saturation",
        }
    ),
    quiet=frozenset({"publish_state", "activate_state_publisher"}),
    neutral={
        **dict.fromkeys(("i_clamp_min", "i_clamp_max", "u_clamp_min", "u_clamp_max"), (math.inf, -math.inf)),
        "i_clamp": (math.inf,), "normalize_error": (False,), "angle_wraparound": (False,), "saturation": (False, 0.0),
    },
    unserved={"antiwindup_strategy": ("legacy",)},
)  # fmt: skip
INTERFACES: Final = ("position", "velocity", "effort")

_WIDEST: Final = dict.fromkeys(("trajectory", "goal"), bounds_of(JointTolerance, ())[1])

JOINT_TRAJECTORY: Final = Table(
    own="joint_trajectory",
    types={
        **{f"{name}_controllers/JointTrajectoryController": {"command_interfaces": name} for name in INTERFACES},
        "pos_vel_controllers/JointTrajectoryController": {"command_interfaces": "position velocity"},
        "pos_vel_acc_controllers/JointTrajectoryController": {"command_interfaces": "position velocity acceleration"},
        "joint_trajectory_controller/JointTrajectoryController": {},
        # Universal Robots': the same, slowed down by the arm's own speed slider, which is at 100 % here.
        "ur_controllers/ScaledJointTrajectoryController": {},
        "position_controllers/ScaledJointTrajectoryController": {"command_interfaces": "position"},
        "velocity_controllers/ScaledJointTrajectoryController": {"command_interfaces": "velocity"},
    },
    parameters=Block(
        known=_ANY | {"hold_trajectory_duration", "velocity_ff"}
        | {"set_last_command_interface_value_as_state_on_activation"},
        quiet=_EVERYWHERE | {"action_monitor_rate", "speed_scaling_interface_name"},
        renamed={"open_loop_control": "interpolate_from_desired_state"},
        unwritten=frozenset({"open_loop_control"}),
        inner={
            "gains": Block(joint=_GAINS),
            "constraints": Block(inner={"joints": Block(joint=Block(most=_WIDEST))}),
            "positions_upsampling": Block(
                known=frozenset({"policy_frequency"}), neutral={"policy_frequency": (0, 0.0)}
            ),
            "speed_scaling": Block(
                known=frozenset({"state_interface", "command_interface"}),
                neutral={"state_interface": ("",), "command_interface": ("",)},
            ),
        },
        neutral=_NEUTRAL | {"command_joints": ([],)},
        refused={"command_joints": "only `joints` can be commanded: give the same names, or the references "
                 "of one controller (`CONTROLLER/joint`)"},
        filled=frozenset({"command_interfaces"}),
    ),
    ros2={"": "joint_trajectory_controller/JointTrajectoryController"},
    reshape=joint_trajectory,
    unshape=to_joint_trajectory,
)  # fmt: skip

GRIPPER: Final = Table(
    own="gripper",
    types={
        "effort_controllers/GripperActionController": {"command_interface": "effort"},
        "position_controllers/GripperActionController": {"command_interface": "position"},
        "parallel_gripper_action_controller/GripperActionController": {"command_interface": "position"},
    },
    idle={"position": ("gains", "max_effort")},
    parameters=Block(
        known=_ANY | {"allow_stalling", "max_effort_interface", "max_velocity_interface"},
        quiet=_EVERYWHERE | {"state_interfaces", "action_monitor_rate"},
        renamed={
            "stall_velocity_threshold": "stall_velocity", "stall_timeout": "stall_time", "max_velocity": "speed",
        },
        inner={"gains": Block(joint=_GAINS)},
        neutral=_NEUTRAL | {
            "max_effort_interface": ("",), "max_velocity_interface": ("",), "allow_stalling": (True,),
            "max_effort": (0, 0.0),
        },
    ),
    ros2={f: f"{f}_controllers/GripperActionController" for f in ("effort", "position")},
    reshape=one_joint,
    unshape=to_gripper,
)  # fmt: skip

FORWARD: Final = Table(
    own="forward_command",
    types={
        "forward_command_controller/ForwardCommandController": {},
        "position_controllers/JointGroupPositionController": {"command_interface": "position"},
        "velocity_controllers/JointGroupVelocityController": {"command_interface": "velocity"},
        "effort_controllers/JointGroupEffortController": {"command_interface": "effort"},
        "position_controllers/JointPositionController": {"command_interface": "position"},
        "velocity_controllers/JointVelocityController": {"command_interface": "velocity"},
        "effort_controllers/JointEffortController": {"command_interface": "effort"},
    },
    parameters=Block(
        known=_ANY,
        quiet=_EVERYWHERE,
        renamed={"interface_name": "command_interface"},
        neutral=_NEUTRAL,
    ),
    ros2={"": "forward_command_controller/ForwardCommandController"},
    reshape=forward,
    unshape=to_forward,
    interface="interface_name",
)

PID: Final = Table(
    own="pid",
    types={
        "pid_controller/PidController": {},
        "effort_controllers/JointPositionController": {"command_interface": "effort"},
        "effort_controllers/JointGroupPositionController": {"command_interface": "effort"},
        "velocity_controllers/JointPositionController": {"command_interface": "velocity"},
        "effort_controllers/JointVelocityController": {
            "command_interface": "effort", "reference_and_state_interfaces": "velocity",
        },
    },
    parameters=Block(
        known=_ANY | {
            "use_external_measured_states", "enable_feedforward",
            "measured_state_suffix", "export_params",
        },
        quiet=_EVERYWHERE,
        renamed={"dof_names": "joints"},
        inner={"gains": Block(joint=_GAINS)},
        neutral=_NEUTRAL | {"reference_and_state_dof_names": ([],), "use_external_measured_states": (False,)},
        refused={"reference_and_state_dof_names": "its states are those of `dof_names`: give the same names there, or "
                 "the references of one controller (`CONTROLLER/joint`)"},
    ),
    ros2={"": "pid_controller/PidController"},
    reshape=pid,
    unshape=to_pid,
)  # fmt: skip

JOINT_STATES: Final = Table(
    own="joint_state_broadcaster",
    types={"joint_state_broadcaster/JointStateBroadcaster": {}, "joint_state_controller/JointStateController": {}},
    parameters=Block(
        known=_ANY | {"extra_joints", "map_interface_to_joint_state"},
        quiet=_EVERYWHERE | {"use_local_topics", "use_urdf_to_filter", "frame_id", "publish_dynamic_joint_states"},
        renamed={"interfaces": "state_interfaces"},
        neutral=_NEUTRAL | {
            "state_interfaces": ([],), "joints": ([],), "extra_joints": ([],),
            "map_interface_to_joint_state": ({name: name for name in INTERFACES},),
        },
    ),
    ros2={"": "joint_state_broadcaster/JointStateBroadcaster"},
)  # fmt: skip

WRENCH: Final = Table(
    own="force_torque_broadcaster",
    types={
        "force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster": {},
        "force_torque_sensor_controller/ForceTorqueSensorController": {},
    },
    parameters=Block(
        known=_ANY | {
            "additional_frames_to_publish", "sensor_filter_chain", "offset", "multiplier", "state_interface_names",
            "topic_name",
        },
        quiet=_EVERYWHERE | {"sensor_name", "interface_names"},
        neutral=_NEUTRAL | {"additional_frames_to_publish": ([],)},
    ),
    ros2={"": "force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster"},
    unshape=to_wrench,
    needs=("link", "frame_id"),
)  # fmt: skip

TABLES: Final = (JOINT_TRAJECTORY, GRIPPER, FORWARD, PID, JOINT_STATES, WRENCH)
BY_TYPE: Final = {name: table for table in TABLES for name in table.types}

ELSEWHERE: Final = frozenset(name for table in TABLES for name in table.parameters.names) | {
    "allow_integration_in_goal_trajectories", "allow_nonzero_velocity_at_trajectory_end", "allow_partial_joints_goal",
    "allow_trajectory_replacement", "cmd_timeout", "command_interface", "command_interfaces", "constraints", "gains",
    "goal_tolerance", "interpolate_from_desired_state", "interpolation_method", "joint", "joints", "max_effort", "pid",
    "reference_and_state_interfaces", "set_current_state_as_first_setpoint", "state_interfaces",
    "stop_trajectory_duration",
} | {
    "admittance", "base_frame_id", "chainable_command_interfaces", "control", "enable_odom_tf", "fixed_world_frame",
    "ft_sensor", "gpios", "joint_limits", "kinematics", "left_wheel_names", "odom_frame_id", "open_loop", "pose_name",
    "right_wheel_names", "sensor_names", "static_covariance_angular_velocity",
    "static_covariance_linear_acceleration", "static_covariance_orientation", "tf", "wheel_radius",
    "wheel_separation",
}  # fmt: skip
"""Parameters of any ROS controller, supported here or not; other controllers ignore them."""

UNSERVED_TYPES: Final = frozenset(
    {
        "ackermann_steering_controller/AckermannSteeringController",
        "admittance_controller/AdmittanceController",
        "battery_state_broadcaster/BatteryStateBroadcaster",
        "bicycle_steering_controller/BicycleSteeringController",
        "chained_filter_controller/ChainedFilter",
        "diff_drive_controller/DiffDriveController",
        "forward_command_controller/MultiInterfaceForwardCommandController",
        "four_wheel_steering_controller/FourWheelSteeringController",
        "gpio_controllers/GpioCommandController",
        "gps_sensor_broadcaster/GPSSensorBroadcaster",
        "imu_sensor_broadcaster/IMUSensorBroadcaster",
        "imu_sensor_controller/ImuSensorController",
        "magnetometer_broadcaster/MagnetometerBroadcaster",
        "mecanum_drive_controller/MecanumDriveController",
        "motion_primitives_controllers/MotionPrimitivesForwardController",
        "omni_wheel_drive_controller/OmniWheelDriveController",
        "pose_broadcaster/PoseBroadcaster",
        "range_sensor_broadcaster/RangeSensorBroadcaster",
        "state_interfaces_broadcaster/StateInterfacesBroadcaster",
        "tricycle_controller/TricycleController",
        "tricycle_steering_controller/TricycleSteeringController",
    }
)
"""ROS controllers that manipcli does not support: left out with a warning."""

VENDORS: Final = frozenset({"ur_controllers"})
"""Packages of vendors, of which some types are served."""

PACKAGES: Final = frozenset(word.partition("/")[0] for word in (*BY_TYPE, *UNSERVED_TYPES)) - VENDORS | {
    "gripper_controllers"
}
"""ROS's own packages of controllers, whose types are all listed. Any other package is a vendor's."""

MANAGER: Final = Block(
    known=frozenset(
        {
            "allow_controller_activation_with_inactive_hardware", "defaults", "enforce_command_limits",
            "deactivate_controllers_on_hardware_self_deactivate", "handle_exceptions",
            "hardware_components_initial_state", "shutdown_on_initial_state_failure",
        }
    ),
    quiet=frozenset(
        {
            "cpu_affinity", "controller_plugins", "diagnostics", "lock_memory", "overruns", "robot_description",
            "thread_priority", "update_rate", "use_sim_time",
        }
    ),
    neutral={"enforce_command_limits": (True,), "handle_exceptions": (True,)},
)  # fmt: skip
"""Parameters of ROS 2's controller manager itself."""

OTHER_NODES: Final = frozenset(
    {
        "controller_list", "controller_manager", "controller_manager_ns", "controller_names", "controller_stopper",
        "generic_hw_control_loop", "hardware_control_loop", "hardware_interface",
        "joint_group_limits", "joint_limits", "joint_state_publisher", "joint_state_publisher_gui", "move_group",
        "moveit_controller_manager", "moveit_manage_controllers", "moveit_sim_hw_interface",
        "moveit_simple_controller_manager", "robot_description", "robot_state_publisher", "ros2_control_node",
        "ros_control_namespace", "rviz2", "servo_node", "sim_control_mode", "trajectory_execution", "use_sim_time",
    }
)  # fmt: skip
"""Other blocks of ROS files with controllers."""

SIMULATORS: Final = frozenset(
    {"gazebo_ros_control", "gazebo_ros2_control", "gz_ros_control", "gz_ros2_control", "ign_ros2_control"}
)
"""Plugins of simulators, whose parameters have no meaning here."""


def _default(here: str, ros2: str, ros1: str | None = None) -> dict[str, str]:
    theirs = {"ros1": ros2 if ros1 is None else ros1, "ros2": ros2}
    return {form: f"{here} (ROS: {value})" for form, value in theirs.items() if value != here}


DEFAULTS: Final[dict[str, dict[str, dict[str, str]]]] = {
    "joint_trajectory": {
        "constraints.goal_time": _default("2 s", "0, no time limit", "0, no extra time"),
        "constraints.stopped_velocity_tolerance": _default("0.05", "0.01"),
        "constraints.decelerate_on_cancel": _default("true", "false"),
        "interpolate_from_desired_state": _default("true", "false", "true"),
    },
    "gripper": {
        "goal_tolerance": _default("0.05 rad or 0.002 m", "0.01"),
        "stall_velocity": _default("0.02 rad/s or 0.001 m/s", "0.001"),
        "stall_time": _default("0.2 s", "1 s"),
    },
}
"""Our type -> key -> by the form of the file, our default and that of ROS, where they differ."""
