"""What a live session offers: topics, actions and services with their types, from the controllers of the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, TypeGuard

import numpy.typing as npt

from manipcli.control.controller import Controller
from manipcli.record import schemas
from manipcli.record.channels import LIVE_COMMANDS, Recorded, channel_table
from manipcli.run.run_log import action_of

CLOCK: Final = "/clock"
LIST_CONTROLLERS: Final = "/controller_manager/list_controllers"
SWITCH_CONTROLLER: Final = "/controller_manager/switch_controller"
_SERVICES = {
    LIST_CONTROLLERS: "controller_manager_msgs/srv/ListControllers",
    SWITCH_CONTROLLER: "controller_manager_msgs/srv/SwitchController",
}
_ACTIONS = {
    "follow_joint_trajectory": "control_msgs/action/FollowJointTrajectory",
    "gripper_cmd": "control_msgs/action/ParallelGripperCommand",
}


class Commanded(Controller, Protocol):
    """A controller that takes one value per joint."""

    def set_command(self, values: npt.ArrayLike) -> None:
        """Set the command from the next update on.

        Raises:
            InvalidArgument: not one finite number per joint.
        """
        ...


def is_commanded(controller: Controller) -> TypeGuard[Commanded]:
    """Whether it has a topic for commands."""
    return hasattr(controller, "set_command")


@dataclass(frozen=True, slots=True)
class Offer:
    """Names and types; read by all threads.

    Attributes:
        published: topics that clients can subscribe, and their types.
        latched: those whose last message a new subscriber gets at once.
        received: topics that clients can publish.
        actions: action servers.
        services: services that the control loop answers.
        readers: those of them that change nothing.
    """

    published: Mapping[str, str]
    latched: frozenset[str]
    received: Mapping[str, str]
    actions: Mapping[str, str]
    services: Mapping[str, str]
    readers: frozenset[str] = frozenset({LIST_CONTROLLERS})

    @property
    def topics(self) -> dict[str, str]:
        """All topics, out and in."""
        return {**self.published, **self.received}


def offer_of(controllers: Sequence[Controller], recorded: Sequence[Recorded]) -> Offer:
    """The interface of a robot with these controllers; `recorded`: their channels in the log."""
    table = [channel for channel in channel_table(recorded) if channel.topic != LIVE_COMMANDS]
    received, actions = {}, {}
    for controller in controllers:
        action = action_of(controller)
        if action:
            actions[f"/{controller.name}/{action}"] = _ACTIONS[action]
        if action == "follow_joint_trajectory":
            received[f"/{controller.name}/joint_trajectory"] = schemas.JOINT_TRAJECTORY
        if is_commanded(controller):
            received[f"/{controller.name}/commands"] = schemas.FLOAT64_MULTI_ARRAY
    return Offer(
        published={CLOCK: schemas.CLOCK, **{channel.topic: channel.type for channel in table}},
        latched=frozenset(channel.topic for channel in table if channel.latched),
        received=received,
        actions=actions,
        services=_SERVICES,
    )


def goal_type(action_type: str) -> str:
    """`control_msgs/FollowJointTrajectory_Goal` of `control_msgs/action/FollowJointTrajectory`."""
    return f"{action_type.replace('/action/', '/')}_Goal"


def request_type(service_type: str) -> str:
    """`controller_manager_msgs/SwitchController_Request` of `controller_manager_msgs/srv/SwitchController`."""
    return f"{service_type.replace('/srv/', '/')}_Request"
