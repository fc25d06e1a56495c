"""Topics and actions of controllers: trajectories, commands, and goals of grippers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from manipcli.control.action import Feedback, GoalHandle, refuse_inactive
from manipcli.control.controller import Controller
from manipcli.control.roles import is_commanded, is_follower, is_hand, is_referenced
from manipcli.core.errors import InvalidArgument
from manipcli.live.command import Answer, Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.goals import action_goal, gripper_goal, topic_goal
from manipcli.live.live_robot import LiveRobot
from manipcli.live.names import GoalStatus
from manipcli.record import schemas
from manipcli.record.json_message import definition, to_json
from manipcli.run.run_log import action_of
from manipcli.task.task import Task

_FOLLOW: Final = "control_msgs/action/FollowJointTrajectory"
_GRIP: Final = "control_msgs/action/ParallelGripperCommand"


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those of each controller, under its name."""
    for controller in controllers:
        name, action = controller.name, action_of(controller)
        if action == "follow_joint_trajectory":
            yield Endpoint("topic", f"/{name}/joint_trajectory", schemas.JOINT_TRAJECTORY, _follow_topic)
            yield Endpoint("action", f"/{name}/{action}", _FOLLOW, _follow)
        elif action == "gripper_cmd":
            yield Endpoint("action", f"/{name}/{action}", _GRIP, _grip)
        if is_commanded(controller):
            yield Endpoint("topic", f"/{name}/commands", schemas.FLOAT64_MULTI_ARRAY, _command)
        if is_referenced(controller):
            yield Endpoint("topic", f"/{name}/reference", "control_msgs/msg/MultiDOFCommand", _refer)


def node_of(command: Command) -> str:
    """The controller under whose name a command was sent."""
    return command.name.strip("/").rpartition("/")[0]


def controller_of(robot: LiveRobot, command: Command) -> Controller:
    """The same as an object.

    Raises:
        InvalidArgument: it is not loaded.
    """
    return robot.manager[node_of(command)]


def _follow_topic(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    controller = controller_of(robot, command)
    assert is_follower(controller)
    robot.observer.goal(controller.name, controller.send_goal(topic_goal(message, robot.time)))


def _follow(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    controller = controller_of(robot, command)
    assert is_follower(controller)
    handle = controller.send_goal(action_goal(message, robot.time))
    _accept(robot, command, controller.name, handle, gripper=False)


def _grip(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    controller = controller_of(robot, command)
    assert is_hand(controller)
    handle = controller.send_goal(gripper_goal(message, controller.joints))
    _accept(robot, command, controller.name, handle, gripper=True)


def _command(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    controller = controller_of(robot, command)
    assert is_commanded(controller)
    refuse_unless_active(robot, controller)
    controller.set_command(message["data"])


def _refer(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    """The reference of a `pid`, by joint or in the order of its joints."""
    controller = controller_of(robot, command)
    assert is_referenced(controller)
    refuse_unless_active(robot, controller)
    names, values, rates = message["dof_names"], message["values"], message["values_dot"]
    if names and sorted(names) != sorted(controller.joints):
        text = f"dof_names are {', '.join(names)[:200]}; expected each joint of controller '{controller.name}' once"
        raise InvalidArgument("LIVE154", text, hint=f"joints: {', '.join(controller.joints)}")
    n = len(controller.joints)
    if len(values) != n or len(rates) not in (0, n):
        text = f"{len(values)} values and {len(rates)} values_dot for {n} joints of controller '{controller.name}'"
        raise InvalidArgument("LIVE154", text, hint=f"joints: {', '.join(controller.joints)}")
    order = [names.index(joint) for joint in controller.joints] if names else range(n)
    controller.set_reference([values[k] for k in order], [rates[k] for k in order] if rates else None)


def refuse_unless_active(robot: LiveRobot, controller: Controller) -> None:
    """
    Raises:
        GoalRejected: the controller is not active.
    """
    refuse_inactive(controller.name, robot.manager.is_active(controller.name))


def _accept(robot: LiveRobot, command: Command, controller: str, handle: GoalHandle, *, gripper: bool) -> None:
    robot.observer.goal(controller, handle)
    robot.goals.append(ControllerGoal(robot, command, controller, handle, gripper))


@dataclass(frozen=True, slots=True)
class ControllerGoal:
    """A goal of a controller."""

    robot: LiveRobot
    command: Command
    controller: str
    handle: GoalHandle
    gripper: bool

    def cancel(self) -> None:
        self.handle.cancel()

    def step(self, *, due: bool) -> Answer | None:
        result = self.handle.result
        if result is None:
            return Answer(True, self._feedback(self.handle.feedback())) if due else None
        if self.gripper:
            state = self._feedback(self.handle.feedback())["state"]
            values: Values = {"state": state, "stalled": result.stalled, "reached_goal": result.reached_goal}
        else:
            values = {"error_code": int(result.code), "error_string": result.text}
        return Answer(True, values, status=GoalStatus[result.status.upper()])

    def _feedback(self, feedback: Feedback) -> Values:
        """The `feedback` of the message that the log has, by the same encoder."""
        data, kind = self.robot.recorder.feedback_message(self.robot.session.ticks, self.controller, feedback)
        values = to_json(definition(kind), data)["feedback"]
        assert isinstance(values, dict)
        return values
