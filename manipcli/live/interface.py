"""What a live session offers: topics, actions and services with their types, from the controllers of the robot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.control.controller import Controller
from manipcli.live.endpoint import Endpoint
from manipcli.live.interfaces import (
    controller_manager,
    controllers,
    emergency_stop,
    entities,
    jog,
    parameters,
    path,
    simulation,
)
from manipcli.record import schemas
from manipcli.record.channels import LIVE_COMMANDS, Recorded, channel_table
from manipcli.task.task import Task

CLOCK: Final = "/clock"
INTERFACES: Final = (
    controllers.endpoints,
    path.endpoints,
    jog.endpoints,
    emergency_stop.endpoints,
    controller_manager.endpoints,
    parameters.endpoints,
    simulation.endpoints,
    entities.endpoints,
)
"""Groups of endpoints: (task, controllers) -> its endpoints."""


def endpoints_of(task: Task, loaded: Sequence[Controller]) -> tuple[Endpoint, ...]:
    """All endpoints of a robot with these controllers."""
    return tuple(endpoint for interface in INTERFACES for endpoint in interface(task, loaded))


@dataclass(frozen=True, slots=True)
class Offer:
    """Names and types; plain data, read by all threads.

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
    readers: frozenset[str]

    @property
    def topics(self) -> dict[str, str]:
        """All topics, out and in."""
        return {**self.published, **self.received}


def offer_of(endpoints: Iterable[Endpoint], recorded: Sequence[Recorded]) -> Offer:
    """The offer with these endpoints; `recorded`: channels of controllers in the log."""
    table = [channel for channel in channel_table(recorded) if channel.topic != LIVE_COMMANDS]
    names: dict[str, dict[str, str]] = {"topic": {}, "action": {}, "service": {}}
    for endpoint in endpoints:
        names[endpoint.kind][endpoint.name] = endpoint.type
    return Offer(
        published={CLOCK: schemas.CLOCK, **{channel.topic: channel.type for channel in table}},
        latched=frozenset(channel.topic for channel in table if channel.latched),
        received=names["topic"],
        actions=names["action"],
        services=names["service"],
        readers=frozenset(endpoint.name for endpoint in endpoints if endpoint.reads),
    )


def goal_type(action_type: str) -> str:
    """`control_msgs/FollowJointTrajectory_Goal` of `control_msgs/action/FollowJointTrajectory`."""
    return f"{action_type.replace('/action/', '/')}_Goal"


def request_type(service_type: str) -> str:
    """`controller_manager_msgs/SwitchController_Request` of `controller_manager_msgs/srv/SwitchController`."""
    return f"{service_type.replace('/srv/', '/')}_Request"
