"""Goals of controllers from ROS messages, as complete JSON objects (`record/json_message.py`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from manipcli.control.action import ErrorCode, GoalRejected, GripperGoal
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.core.text import did_you_mean
from manipcli.plan.motion import JointTolerance
from manipcli.plan.trajectory import JointTrajectory

LONGEST: Final = 300.0
"""[s] Longest trajectory: its references are computed for every tick when it begins."""
_TOLERANCES = ("position", "velocity", "acceleration")


def topic_goal(message: dict[str, Any], now: float) -> TrajectoryGoal:
    """The goal of a trajectory_msgs/JointTrajectory; a stamp of 0 begins at the next update.

    Args:
        message: the message.
        now: simulated time [s].

    Raises:
        InvalidArgument: it is not a trajectory, too long or too late.
    """
    points = [{**point, "time_from_start": seconds(point["time_from_start"])} for point in message["points"]]
    if points and not points[-1]["time_from_start"] <= LONGEST:
        raise GoalRejected("LIVE120", f"the trajectory takes more than {LONGEST:g} s")
    start = seconds(message["header"]["stamp"])
    if start > now + LONGEST:
        raise GoalRejected("LIVE120", f"the trajectory begins at {start:g} s, more than {LONGEST:g} s from now")
    return TrajectoryGoal(JointTrajectory(message["joint_names"], points), start_time=start)


def action_goal(message: dict[str, Any], now: float) -> TrajectoryGoal:
    """The goal of a control_msgs/FollowJointTrajectory_Goal; see `topic_goal`."""
    if message["multi_dof_trajectory"]["points"]:
        raise GoalRejected("LIVE121", "multi_dof_trajectory is not supported; use trajectory")
    for field in ("component_path_tolerance", "component_goal_tolerance"):
        if message[field]:
            raise GoalRejected("LIVE121", f"{field} is not supported; use tolerances of joints")
    goal = topic_goal(message["trajectory"], now)
    path, end = (
        tuple(JointTolerance(each["name"], *(each[word] for word in _TOLERANCES)) for each in message[field])
        for field in ("path_tolerance", "goal_tolerance")
    )
    grace = seconds(message["goal_time_tolerance"])
    return TrajectoryGoal(goal.trajectory, goal.start_time, path, end, grace)


def gripper_goal(message: dict[str, Any], joints: Sequence[str]) -> GripperGoal:
    """The goal of a control_msgs/ParallelGripperCommand_Goal: positions by joint, or one position for all joints.

    Args:
        message: the goal.
        joints: of the controller.

    Raises:
        GoalRejected: unknown or missing joints, or another number of values.
    """
    command = message["command"]
    names, position, effort = command["name"], command["position"], command["effort"]
    if not names and len(position) == 1 and len(effort) <= 1:
        return GripperGoal(position[0], max_effort=effort[0] if effort else None)
    for name in names:
        if name not in joints:
            hint = did_you_mean(name, joints, kind="joints")
            raise _wrong_joints(f"joint '{name}' is not a joint of the controller", hint)
    missing = [joint for joint in joints if joint not in names]
    if missing or len(names) != len(joints):
        what = f"no position for joint '{missing[0]}'" if missing else "a joint is named more than once"
        raise _wrong_joints(what, f"joints: {', '.join(joints)}")
    if len(position) != len(names) or len(effort) not in (0, len(names)):
        raise _wrong_joints(f"{len(position)} positions and {len(effort)} efforts for {len(names)} joints", None)
    order = [names.index(joint) for joint in joints]
    efforts = [effort[k] for k in order] if effort else None
    return GripperGoal([position[k] for k in order], max_effort=efforts)  # type: ignore[arg-type]


def _wrong_joints(what: str, hint: str | None) -> GoalRejected:
    return GoalRejected("LIVE122", what, hint=hint, error_code=ErrorCode.INVALID_JOINTS)


def seconds(time: dict[str, int]) -> float:
    """[s] of a builtin_interfaces/Time or Duration."""
    return time["sec"] + 1e-9 * time["nanosec"]
