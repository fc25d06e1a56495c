"""ROS 2 message types of a recording: a table of definitions, and the `ros2msg` text of a type.

The text of a schema is the definition of its type, followed by the definitions of every type it uses, each after a
line of 80 `=` and a line `MSG: package/Name` (the format of the `ros2msg` schema encoding of MCAP).
"""

from __future__ import annotations

from manipcli.record.foxglove_definitions import FOXGLOVE
from manipcli.record.parameter_schemas import PARAMETERS
from manipcli.record.rosapi_definitions import ROSAPI
from manipcli.record.simulation_schemas import SIMULATION

STRING = "std_msgs/msg/String"
TF_MESSAGE = "tf2_msgs/msg/TFMessage"
JOINT_STATE = "sensor_msgs/msg/JointState"
CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
GOAL_STATUS_ARRAY = "action_msgs/msg/GoalStatusArray"
ACTIONS = {
    name: (f"control_msgs/action/{kind}_FeedbackMessage", f"control_msgs/action/{kind}_GetResult_Response")
    for name, kind in (("follow_joint_trajectory", "FollowJointTrajectory"), ("gripper_cmd", "ParallelGripperCommand"))
}
"""Types of feedback and result of each controller action."""
LOG = "rcl_interfaces/msg/Log"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"
CONTACTS = "manipcli_msgs/msg/Contacts"
TASK_EVENT = "manipcli_msgs/msg/TaskEvent"
CLOCK = "rosgraph_msgs/msg/Clock"
JOINT_TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
FLOAT64_MULTI_ARRAY = "std_msgs/msg/Float64MultiArray"
TWIST = "geometry_msgs/msg/TwistStamped"
JOINT_JOG = "control_msgs/msg/JointJog"
TRIGGER = "std_srvs/srv/Trigger"
LIVE_COMMAND = "manipcli_msgs/msg/LiveCommand"
SCENE_UPDATE = "foxglove_msgs/msg/SceneUpdate"

_CONTACT = (
    "# Two touching parts: names of scene bodies, or robot/<link>; a <= b.\n"
    "string a\nstring b\n"
    "# Sum of the normal forces between the two [N].\n"
    "float64 force\n"
    "# Distance at the deepest point [m], negative when they penetrate.\n"
    "float64 distance\n"
)

DEFINITIONS: dict[str, str] = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec\n",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "std_msgs/String": "string data\n",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    "geometry_msgs/PoseWithCovarianceStamped": ("std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"),
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    "geometry_msgs/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist\n",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms\n",
    "sensor_msgs/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    ),
    "sensor_msgs/Imu": (
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
    ),
    "manipcli_msgs/ContactSwitch": (
        "# A switch that is closed by contact.\nstd_msgs/Header header\n"
        "# Whether `force` is at least `threshold`.\nbool closed\n"
        "# Measured sum of the normal forces on the link or body, and the threshold [N].\n"
        "float64 force\nfloat64 threshold\n"
    ),
    "manipcli_msgs/Taxels": (
        "# A grid of taxels in the plane z = 0 of the frame in the header, its middle at the origin; +z points out of\n"
        "# the surface.\nstd_msgs/Header header\n"
        "# Cells along y and along x.\nuint32 rows\nuint32 columns\n"
        "# Size of a cell along x and along y [m].\nfloat64 width\nfloat64 height\n"
        "# Normal force on each cell [N], row by row from the lowest y, each from the lowest x.\nfloat64[] force\n"
    ),
    "manipcli_msgs/TaxelShear": (
        "# The tangential forces on the cells of a grid of taxels, which is as in Taxels.\nstd_msgs/Header header\n"
        "# Cells along y and along x.\nuint32 rows\nuint32 columns\n"
        "# Size of a cell along x and along y [m].\nfloat64 width\nfloat64 height\n"
        "# Force on each cell along x and along y of the frame [N], in the order of Taxels.\nfloat64[] x\nfloat64[] y\n"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data\n",
    "sensor_msgs/Image": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
        "uint8[] data\n"
    ),
    "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
    "sensor_msgs/CameraInfo": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
        "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"
    ),
    "sensor_msgs/PointField": (
        "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\n"
        "uint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n"
    ),
    "sensor_msgs/PointCloud2": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n"
        "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"
    ),
    "sensor_msgs/LaserScan": (
        "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n"
        "float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\n"
        "float32[] intensities\n"
    ),
    "sensor_msgs/Range": (
        "std_msgs/Header header\nuint8 ULTRASOUND=0\nuint8 INFRARED=1\nuint8 radiation_type\nfloat32 field_of_view\n"
        "float32 min_range\nfloat32 max_range\nfloat32 range\nfloat32 variance\n"
    ),
    "vision_msgs/VisionClass": "uint16 class_id\nstring class_name\n",
    "vision_msgs/LabelInfo": "std_msgs/Header header\nvision_msgs/VisionClass[] class_map\nfloat32 threshold\n",
    "trajectory_msgs/JointTrajectoryPoint": (
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start\n"
    ),
    "trajectory_msgs/MultiDOFJointTrajectoryPoint": (
        "geometry_msgs/Transform[] transforms\ngeometry_msgs/Twist[] velocities\ngeometry_msgs/Twist[] accelerations\n"
        "builtin_interfaces/Duration time_from_start\n"
    ),
    "control_msgs/JointTrajectoryControllerState": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint reference\n"
        "trajectory_msgs/JointTrajectoryPoint feedback\n"
        "trajectory_msgs/JointTrajectoryPoint error\n"
        "trajectory_msgs/JointTrajectoryPoint output\n"
        "string[] multi_dof_joint_names\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_reference\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_feedback\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_output\n"
        "float64 speed_scaling_factor\n"
    ),
    "unique_identifier_msgs/UUID": "uint8[16] uuid\n",
    "action_msgs/GoalInfo": "unique_identifier_msgs/UUID goal_id\nbuiltin_interfaces/Time stamp\n",
    "action_msgs/GoalStatus": (
        "int8 STATUS_UNKNOWN=0\nint8 STATUS_ACCEPTED=1\nint8 STATUS_EXECUTING=2\nint8 STATUS_CANCELING=3\n"
        "int8 STATUS_SUCCEEDED=4\nint8 STATUS_CANCELED=5\nint8 STATUS_ABORTED=6\n"
        "action_msgs/GoalInfo goal_info\nint8 status\n"
    ),
    "action_msgs/GoalStatusArray": "action_msgs/GoalStatus[] status_list\n",
    "control_msgs/FollowJointTrajectory_Feedback": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint desired\n"
        "trajectory_msgs/JointTrajectoryPoint actual\n"
        "trajectory_msgs/JointTrajectoryPoint error\n"
        "string[] multi_dof_joint_names\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_desired\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_actual\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error\n"
    ),
    "control_msgs/FollowJointTrajectory_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id\ncontrol_msgs/FollowJointTrajectory_Feedback feedback\n"
    ),
    "control_msgs/FollowJointTrajectory_Result": (
        "int32 error_code\nint32 SUCCESSFUL=0\nint32 INVALID_GOAL=-1\nint32 INVALID_JOINTS=-2\n"
        "int32 OLD_HEADER_TIMESTAMP=-3\nint32 PATH_TOLERANCE_VIOLATED=-4\nint32 GOAL_TOLERANCE_VIOLATED=-5\n"
        "string error_string\n"
    ),
    "control_msgs/FollowJointTrajectory_GetResult_Response": (
        "int8 status\ncontrol_msgs/FollowJointTrajectory_Result result\n"
    ),
    "control_msgs/ParallelGripperCommand_Feedback": "sensor_msgs/JointState state\n",
    "control_msgs/ParallelGripperCommand_FeedbackMessage": (
        "unique_identifier_msgs/UUID goal_id\ncontrol_msgs/ParallelGripperCommand_Feedback feedback\n"
    ),
    "control_msgs/ParallelGripperCommand_Result": "sensor_msgs/JointState state\nbool stalled\nbool reached_goal\n",
    "control_msgs/ParallelGripperCommand_GetResult_Response": (
        "int8 status\ncontrol_msgs/ParallelGripperCommand_Result result\n"
    ),
    "rcl_interfaces/Log": (
        "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n"
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\n"
        "string file\nstring function\nuint32 line\n"
    ),
    "visualization_msgs/UVCoordinate": "float32 u\nfloat32 v\n",
    "visualization_msgs/MeshFile": "string filename\nuint8[] data\n",
    "visualization_msgs/Marker": (
        "int32 ARROW=0\nint32 CUBE=1\nint32 SPHERE=2\nint32 CYLINDER=3\nint32 LINE_STRIP=4\nint32 LINE_LIST=5\n"
        "int32 CUBE_LIST=6\nint32 SPHERE_LIST=7\nint32 POINTS=8\nint32 TEXT_VIEW_FACING=9\nint32 MESH_RESOURCE=10\n"
        "int32 TRIANGLE_LIST=11\nint32 ARROW_STRIP=12\nint32 ADD=0\nint32 MODIFY=0\nint32 DELETE=2\nint32 DELETEALL=3\n"
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n"
        "geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n"
        "bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n"
        "string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n"
    ),
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers\n",
    "manipcli_msgs/ContactPoint": (
        "# A point at which parts a and b touch, at the time of the message; all vectors in the world.\n"
        "# [m]\n"
        "geometry_msgs/Point position\n"
        "# Unit vector out of b towards a: the normal force on a is force * normal.\n"
        "geometry_msgs/Vector3 normal\n"
        "# Normal force [N].\n"
        "float64 force\n"
        "# Friction force on a [N].\n"
        "geometry_msgs/Vector3 friction\n"
    ),
    "manipcli_msgs/Contact": (
        f"{_CONTACT}"
        "# All points at which they touch, as the physics computed them; those without force included.\n"
        "manipcli_msgs/ContactPoint[] points\n"
    ),
    "manipcli_msgs/Contacts": (
        "# Everything that touches from this time on, until the next message.\n"
        "std_msgs/Header header\nmanipcli_msgs/Contact[] contacts\n"
    ),
    "manipcli_msgs/TaskEvent": (
        "# Something happened in the task; `place` is where the step stands in its file (file:line:column).\n"
        "std_msgs/Header header\nstring kind\nstring step\nstring verb\nstring outcome\nstring text\nstring place\n"
    ),
    "manipcli_msgs/LiveCommand": (
        "# A command from outside, and the control tick at which it took effect, before the update of that tick.\n"
        "std_msgs/Header header\nuint32 tick\n"
        "# publish, send_action_goal, cancel_action_goal, call_service, or end: the session ends before this tick.\n"
        "string op\n"
        "# Topic, action or service.\n"
        "string name\n"
        "# Of an action goal: distinct in the session.\n"
        "string id\n"
        "# The message, the goal or the request as JSON.\n"
        "string json\n"
    ),
    "manipcli_msgs/RunStep_Goal": "# A step as in a task file, in YAML or JSON: `{pick: {object: cup}}`\nstring step\n",
    "manipcli_msgs/RunStep_Result": (
        "# Of the step in the log, such as `pick@1`; empty if it is refused.\n"
        "string id\n"
        "# done, failed, timeout, canceled, not_plannable, invalid, or rejected: the robot is busy.\n"
        "string outcome\n"
        "# Why it is not done.\n"
        "string text\n"
        "# By how much it is done, negative if it is not: of its `until`; else of the place of an object that was set\n"
        "# down [m], or of the friction over the weight of an object that was grasped [N]; NaN without one.\n"
        "float64 margin\nstring unit\n"
    ),
    "manipcli_msgs/RunStep_Feedback": (
        "# A phase begins: plan, then the motions of the step by their names.\nstring id\nstring phase\n"
    ),
    "manipcli_msgs/CheckStep_Request": "# As of RunStep.\nstring step\n",
    "manipcli_msgs/CheckStep_Response": (
        "# Whether it is valid, and can be planned from where the robot is; text: why not.\n"
        "bool valid\nbool plannable\nstring text\n"
        "# Its motions, and their planned duration [s]; NaN without a plan.\n"
        "string[] phases\nfloat64 duration\n"
    ),
    "rosgraph_msgs/Clock": "builtin_interfaces/Time clock\n",
    "std_msgs/MultiArrayDimension": "string label\nuint32 size\nuint32 stride\n",
    "std_msgs/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n",
    "std_msgs/Float64MultiArray": "std_msgs/MultiArrayLayout layout\nfloat64[] data\n",
    "trajectory_msgs/JointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n"
    ),
    "trajectory_msgs/MultiDOFJointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/MultiDOFJointTrajectoryPoint[] points\n"
    ),
    "control_msgs/JointTolerance": "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n",
    "control_msgs/JointComponentTolerance": (
        "uint16 X_AXIS=1\nuint16 Y_AXIS=2\nuint16 Z_AXIS=3\nuint16 TRANSLATION=4\nuint16 ROTATION=5\n"
        "string joint_name\nuint16 component\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
    ),
    "control_msgs/FollowJointTrajectory_Goal": (
        "trajectory_msgs/JointTrajectory trajectory\ntrajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory\n"
        "control_msgs/JointTolerance[] path_tolerance\n"
        "control_msgs/JointComponentTolerance[] component_path_tolerance\n"
        "control_msgs/JointTolerance[] goal_tolerance\n"
        "control_msgs/JointComponentTolerance[] component_goal_tolerance\n"
        "builtin_interfaces/Duration goal_time_tolerance\n"
    ),
    "control_msgs/JointJog": (
        "std_msgs/Header header\nstring[] joint_names\nfloat64[] displacements\nfloat64[] velocities\n"
        "float64 duration\n"
    ),
    "std_srvs/Trigger_Request": "",
    "std_srvs/Trigger_Response": "bool success\nstring message\n",
    "control_msgs/ParallelGripperCommand_Goal": "sensor_msgs/JointState command\n",
    "controller_manager_msgs/ChainConnection": "string name\nstring[] reference_interfaces\n",
    "controller_manager_msgs/ControllerState": (
        "string name\nstring state\nstring type\nbool is_async\nuint16 update_rate\nstring[] claimed_interfaces\n"
        "string[] required_command_interfaces\nstring[] required_state_interfaces\nbool is_chainable\n"
        "bool is_chained\nstring[] exported_state_interfaces\nstring[] reference_interfaces\n"
        "controller_manager_msgs/ChainConnection[] chain_connections\n"
    ),
    "controller_manager_msgs/HardwareInterface": "string name\nstring data_type\nbool is_available\nbool is_claimed\n",
    "controller_manager_msgs/ListControllers_Request": "",
    "controller_manager_msgs/ListControllers_Response": "controller_manager_msgs/ControllerState[] controller\n",
    "controller_manager_msgs/SwitchController_Request": (
        "string[] activate_controllers\nstring[] deactivate_controllers\nint32 strictness\n"
        "int32 BEST_EFFORT=1\nint32 STRICT=2\nint32 AUTO=3\nint32 FORCE_AUTO=4\n"
        "bool activate_asap\nbuiltin_interfaces/Duration timeout\n"
    ),
    "controller_manager_msgs/SwitchController_Response": "bool ok\nstring message\n",
    **PARAMETERS,
    **SIMULATION,
    **ROSAPI,
    **FOXGLOVE,
    "controller_manager_msgs/ListControllerTypes_Request": "",
    "controller_manager_msgs/ListControllerTypes_Response": "string[] types\nstring[] base_classes\n",
    "controller_manager_msgs/ListHardwareInterfaces_Request": "",
    "controller_manager_msgs/ListHardwareInterfaces_Response": (
        "controller_manager_msgs/HardwareInterface[] command_interfaces\n"
        "controller_manager_msgs/HardwareInterface[] state_interfaces\n"
    ),
    **{
        f"controller_manager_msgs/{verb}Controller_{part}": fields
        for verb in ("Load", "Configure", "Cleanup", "Unload")
        for part, fields in (("Request", "string name\n"), ("Response", "bool ok\n"))
    },
    "std_msgs/Float64": "float64 data\n",
    "control_msgs/MultiDOFCommand": "string[] dof_names\nfloat64[] values\nfloat64[] values_dot\n",
    "control_msgs/SpeedScalingFactor": "float64 factor\n",
}

CONTACTS_WITHOUT_POINTS = (
    f"std_msgs/Header header\nmanipcli_msgs/Contact[] contacts\n"
    f"{'=' * 80}\nMSG: std_msgs/Header\n{DEFINITIONS['std_msgs/Header']}"
    f"{'=' * 80}\nMSG: manipcli_msgs/Contact\n{_CONTACT}"
)
"""The text of `CONTACTS` in logs of format 1."""


def schema_text(type_name: str) -> str:
    """The whole `ros2msg` text of `package/msg/Name`: its own definition and those it depends on, each once.

    The messages of an action are `package/action/Name_...`.
    """
    root = type_name.replace("/msg/", "/").replace("/action/", "/")
    parts = [DEFINITIONS[root]]
    parts += [f"{'=' * 80}\nMSG: {name}\n{DEFINITIONS[name]}" for name in _dependencies(root, [])]
    return "".join(parts)


def _dependencies(name: str, found: list[str]) -> list[str]:
    """Types that `name` uses, in the order of their first use, depth first."""
    for line in DEFINITIONS[name].splitlines():
        used = line.split()[0].partition("[")[0]
        if "/" in used and used not in found:
            found.append(used)
            _dependencies(used, found)
    return found
