"""Topics and actions of controllers: trajectories, commands, and goals of grippers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, TypeGuard

import numpy.typing as npt

from manipcli.control.action import Feedback, GoalHandle, refuse_inactive
from manipcli.control.controller import Controller
from manipcli.control.roles import is_follower, is_hand
from manipcli.core.errors import InvalidArgument
from manipcli.live.command import Answer, Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.goals import action_goal, gripper_goal, topic_goal
from manipcli.live.live_robot import LiveRobot
from manipcli.record import schemas
from manipcli.record.json_message import definition, to_json
from manipcli.run.run_log import action_of
from manipcli.task.task import Task

ABORTED: Final = 6
STATUS: Final = {"succeeded": 4, "canceled": 5, "aborted": ABORTED}
"""action_msgs/GoalStatus of a goal that ended."""
_FOLLOW = "control_msgs/action/FollowJointTrajectory"
_GRIP = "control_msgs/action/ParallelGripperCommand"


class Commanded(Controller, Protocol):
    """A controller that takes one value per joint."""

    def set_command(self, values: npt.ArrayLike) -> None:
        """Set the command from the next update on.

        Raises:
            InvalidArgument: not one finite number per joint.
        """
        ...


class Referenced(Controller, Protocol):
    """A controller with one reference per joint, and its rate."""

    def set_reference(self, values: npt.ArrayLike, rates: npt.ArrayLike | None = None) -> None:
        """Set the reference from the next update on.

        Raises:
            InvalidArgument: not one finite number per joint, or rates where it has none.
        """
        ...


def is_referenced(controller: Controller) -> TypeGuard[Referenced]:
    """Whether it has a topic for references."""
    return hasattr(controller, "set_reference")


def is_commanded(controller: Controller) -> TypeGuard[Commanded]:
    """Whether it has a topic for commands."""
    return hasattr(controller, "set_command")


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


def controller_of(robot: LiveRobot, command: Command) -> Controller:
    """The controller under whose name a command was sent.

    Raises:
        InvalidArgument: it is not loaded.
    """
    return robot.manager[command.name.strip("/").rpartition("/")[0]]


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
    active = any(info.name == controller.name and info.state == "active" for info in robot.manager.list())
    refuse_inactive(controller.name, active)


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
        return Answer(True, values, status=STATUS[result.status])

    def _feedback(self, feedback: Feedback) -> Values:
        """The `feedback` of the message that the log has, by the same encoder."""
        data, kind = self.robot.recorder.feedback_message(self.robot.session.ticks, self.controller, feedback)
        values = to_json(definition(kind), data)["feedback"]
        assert isinstance(values, dict)
        return values
