"""Topics that jog an arm: the velocity of its tool, or of its joints, for as long as messages arrive.

As in MoveIt Servo (`~/delta_twist_cmds` and `~/delta_joint_cmds`, in units of speed): a message counts for `TIMEOUT`,
then the arm stops. `control/jog.py` and `control/jog_targets.py` have the laws. Collisions are not checked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, Final

import numpy as np

from manipcli.control.action import ErrorCode, GoalRejected
from manipcli.control.controller import Controller
from manipcli.control.jog_targets import JointTarget, ToolTarget
from manipcli.control.roles import is_jogged
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.live.command import Command
from manipcli.live.endpoint import Endpoint, Handler
from manipcli.live.interfaces.controllers import controller_of
from manipcli.live.live_robot import LiveRobot
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel, Tool
from manipcli.record import schemas
from manipcli.task.task import Task

TIMEOUT: Final = 0.2
"""[s] of simulated time after which the arm stops, unless another message arrives."""
LONGEST: Final = 1.0
"""[s] Longest `duration` of a JointJog."""
FASTEST: Final = 100.0
"""[m/s, rad/s] Largest component of a velocity; joints are limited far below it."""
WORLD: Final = "world"
TOOL: Final = "tool"


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those of each controller that follows trajectories; the tool's velocity where its joints move a tool."""
    robot = task.robot
    kinematics = cache(lambda: Kinematics(robot))
    for controller in controllers:
        if not is_jogged(controller):
            continue
        yield Endpoint("topic", f"/{controller.name}/jog_joints", schemas.JOINT_JOG, _jog_joints)
        movers = [joint.name for joint in robot.moving_joints if _moves_tool(robot, joint.child)]
        if robot.tool is not None and set(movers) & set(controller.joints):
            yield Endpoint("topic", f"/{controller.name}/jog", schemas.TWIST, _jog(robot.tool, kinematics))


def _moves_tool(robot: RobotModel, link: str) -> bool:
    return robot.tool is not None and robot.tool.link in robot.descendants(link)


def _jog(tool: Tool, kinematics: Callable[[], Kinematics]) -> Handler:
    """The handler of a geometry_msgs/TwistStamped: the velocity of the tool frame, along the axes of its frame_id."""

    def handle(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
        controller = controller_of(robot, command)
        assert is_jogged(controller)
        twist = message["twist"]
        values = np.array([twist[part][axis] for part in ("linear", "angular") for axis in "xyz"])
        _refuse_fast(values)
        target = ToolTarget(
            kinematics(), controller.joints, np.array(robot.session.state.position), (tool.link, tool.X_LT), values,
            axes=_axes(robot.task.robot, message["header"]["frame_id"]),
        )  # fmt: skip
        controller.jog(target, until=robot.time + TIMEOUT)

    return handle


def _axes(robot: RobotModel, frame: str) -> str | None:
    """The axes of a frame_id, as for `ToolTarget`.

    Raises:
        GoalRejected: LIVE160 there is no such frame.
    """
    links = [link.name for link in robot.links]
    if frame in ("", *links):
        return frame or robot.root
    if frame in (WORLD, TOOL):
        return None if frame == WORLD else ""
    hint = did_you_mean(frame, [*links, WORLD, TOOL]) or f"an empty frame_id is the base, '{robot.root}'"
    raise GoalRejected("LIVE160", f"frame '{frame}' is not a link of the robot", hint=hint)


def _jog_joints(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    """Handles a control_msgs/JointJog: velocities of the named joints; the others stop."""
    controller = controller_of(robot, command)
    assert is_jogged(controller)
    lasting = max(TIMEOUT, _duration(message["duration"]))
    controller.jog(JointTarget(_velocities(controller.joints, message)), until=robot.time + lasting)


def _duration(seconds: float) -> float:
    """
    Raises:
        GoalRejected: LIVE161 it is too long.
    """
    if not 0.0 <= seconds <= LONGEST:
        hint = "send messages again and again; the arm stops when they stop"
        raise GoalRejected("LIVE161", f"a duration of {seconds:g} s; expected 0 to {LONGEST:g} s", hint=hint)
    return seconds


def _velocities(joints: Sequence[str], message: dict[str, Any]) -> Array:
    """(n) velocities of the joints of a controller.

    Raises:
        GoalRejected: LIVE161 displacements, another number of velocities than of names, unknown or duplicate joints.
    """
    names, velocities = message["joint_names"], message["velocities"]
    if message["displacements"]:
        raise GoalRejected("LIVE161", "displacements are not supported", hint="use velocities, or a trajectory")
    if len(names) != len(velocities):
        raise GoalRejected("LIVE161", f"{len(velocities)} velocities for {len(names)} joint_names")
    wanted = np.zeros(len(joints))
    for name, velocity in zip(names, velocities, strict=True):
        if name not in joints or names.count(name) > 1:
            wrong = "is named more than once" if name in joints else "is not a joint of the controller"
            hint = None if name in joints else did_you_mean(name, joints, kind="joints")
            raise GoalRejected("LIVE161", f"joint '{name}' {wrong}", hint=hint, error_code=ErrorCode.INVALID_JOINTS)
        wanted[joints.index(name)] = velocity
    _refuse_fast(wanted)
    return wanted


def _refuse_fast(values: Array) -> None:
    """
    Raises:
        GoalRejected: LIVE161 a component of a velocity is absurd.
    """
    most = float(np.abs(values).max(initial=0.0))
    if most > FASTEST:
        raise GoalRejected("LIVE161", f"a velocity of {most:g}; expected at most {FASTEST:g} m/s or rad/s")
