"""ROS 2 message types of simulation_interfaces 2.1.0 (https://github.com/ros-simulation/simulation_interfaces): those
that a live session serves, field for field."""

from __future__ import annotations

_P = "simulation_interfaces"
_RESULT = f"{_P}/Result result\n"
_ENTITY = "string entity\n"

SIMULATION: dict[str, str] = {
    "geometry_msgs/Accel": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    f"{_P}/Result": (
        "uint8 RESULT_FEATURE_UNSUPPORTED=0\nuint8 RESULT_OK=1\nuint8 RESULT_NOT_FOUND=2\n"
        "uint8 RESULT_INCORRECT_STATE=3\nuint8 RESULT_OPERATION_FAILED=4\nuint8 result\nstring error_message\n"
    ),
    f"{_P}/SimulatorFeatures": (
        "uint8 SPAWNING=0\nuint8 DELETING=1\nuint8 NAMED_POSES=2\nuint8 POSE_BOUNDS=3\nuint8 ENTITY_TAGS=4\n"
        "uint8 ENTITY_BOUNDS=5\nuint8 ENTITY_BOUNDS_BOX=6\nuint8 ENTITY_BOUNDS_CONVEX=7\nuint8 ENTITY_CATEGORIES=8\n"
        "uint8 SPAWNING_RESOURCE_STRING=9\nuint8 ENTITY_STATE_GETTING=10\nuint8 ENTITY_STATE_SETTING=11\n"
        "uint8 ENTITY_INFO_GETTING=12\nuint8 ENTITY_INFO_SETTING=13\nuint8 SPAWNABLES=14\nuint8 SIMULATION_RESET=20\n"
        "uint8 SIMULATION_RESET_TIME=21\nuint8 SIMULATION_RESET_STATE=22\nuint8 SIMULATION_RESET_SPAWNED=23\n"
        "uint8 SIMULATION_STATE_GETTING=24\nuint8 SIMULATION_STATE_SETTING=25\nuint8 SIMULATION_STATE_PAUSE=26\n"
        "uint8 STEP_SIMULATION_SINGLE=31\nuint8 STEP_SIMULATION_MULTIPLE=32\nuint8 STEP_SIMULATION_ACTION=33\n"
        "uint8 WORLD_LOADING=40\nuint8 WORLD_LOADING_STRING=41\nuint8 WORLD_UNLOADING=42\nuint8 WORLD_INFO_GETTING=43\n"
        "uint8 AVAILABLE_WORLDS=44\nuint16[] features\nstring[] spawn_formats\nstring custom_info\n"
    ),
    f"{_P}/SimulationState": (
        "uint8 STATE_STOPPED=0\nuint8 STATE_PLAYING=1\nuint8 STATE_PAUSED=2\nuint8 STATE_QUITTING=3\nuint8 state\n"
    ),
    f"{_P}/EntityCategory": (
        "uint8 CATEGORY_OBJECT=0\nuint8 CATEGORY_ROBOT=1\nuint8 CATEGORY_HUMAN=2\nuint8 CATEGORY_DYNAMIC_OBJECT=4\n"
        "uint8 CATEGORY_STATIC_OBJECT=5\nuint8 category\n"
    ),
    f"{_P}/EntityInfo": f"{_P}/EntityCategory category\nstring description\nstring[] tags\n",
    f"{_P}/EntityState": (
        "std_msgs/Header header\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\ngeometry_msgs/Accel acceleration\n"
    ),
    f"{_P}/TagsFilter": "string[] tags\nuint8 FILTER_MODE_ANY=0\nuint8 FILTER_MODE_ALL=1\nuint8 filter_mode\n",
    f"{_P}/Bounds": (
        "uint8 TYPE_EMPTY=0\nuint8 TYPE_BOX=1\nuint8 TYPE_CONVEX_HULL=2\nuint8 TYPE_SPHERE=3\nuint8 type\n"
        "geometry_msgs/Vector3[] points\n"
    ),
    f"{_P}/EntityFilters": (
        f"string filter\n{_P}/EntityCategory[] categories\n{_P}/TagsFilter tags\n{_P}/Bounds bounds\n"
    ),
    f"{_P}/GetSimulatorFeatures_Request": "",
    f"{_P}/GetSimulatorFeatures_Response": f"{_P}/SimulatorFeatures features\n",
    f"{_P}/GetSimulationState_Request": "",
    f"{_P}/GetSimulationState_Response": f"{_P}/SimulationState state\n{_RESULT}",
    f"{_P}/SetSimulationState_Request": f"{_P}/SimulationState state\n",
    f"{_P}/SetSimulationState_Response": (
        "uint8 ALREADY_IN_TARGET_STATE=101\nuint8 STATE_TRANSITION_ERROR=102\nuint8 INCORRECT_TRANSITION=103\n"
        f"{_RESULT}"
    ),
    f"{_P}/StepSimulation_Request": "uint64 steps 1\n",
    f"{_P}/StepSimulation_Response": _RESULT,
    f"{_P}/SimulateSteps_Goal": "uint64 steps\n",
    f"{_P}/SimulateSteps_Result": _RESULT,
    f"{_P}/SimulateSteps_Feedback": "uint64 completed_steps\nuint64 remaining_steps\n",
    f"{_P}/ResetSimulation_Request": (
        "uint8 SCOPE_DEFAULT=0\nuint8 SCOPE_TIME=1\nuint8 SCOPE_STATE=2\nuint8 SCOPE_SPAWNED=4\nuint8 SCOPE_ALL=255\n"
        "uint8 scope\n"
    ),
    f"{_P}/ResetSimulation_Response": _RESULT,
    f"{_P}/GetEntities_Request": f"{_P}/EntityFilters filters\n",
    f"{_P}/GetEntities_Response": f"{_RESULT}string[] entities\n",
    f"{_P}/GetEntitiesStates_Request": f"{_P}/EntityFilters filters\n",
    f"{_P}/GetEntitiesStates_Response": f"{_RESULT}string[] entities\n{_P}/EntityState[] states\n",
    f"{_P}/GetEntityInfo_Request": _ENTITY,
    f"{_P}/GetEntityInfo_Response": f"{_RESULT}{_P}/EntityInfo info\n",
    f"{_P}/GetEntityState_Request": _ENTITY,
    f"{_P}/GetEntityState_Response": f"{_RESULT}{_P}/EntityState state\n",
    f"{_P}/SetEntityState_Request": f"{_ENTITY}{_P}/EntityState state\n",
    f"{_P}/SetEntityState_Response": _RESULT,
}
