"""What a live session offers: names of topics, actions and services with their types."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

CLOCK: Final = "/clock"
RESET, SESSION_ENDED = "simulation_reset", "session_ended"
"""Kinds of events on `/task/events` at the end of a session; its log, which ends, does not have them."""


@dataclass(frozen=True, slots=True)
class Offer:
    """Names and types; plain data, for the process of the network.

    Attributes:
        published: topics that clients can subscribe, and their types.
        latched: those whose last message a new subscriber gets at once.
        received: topics that clients can publish.
        actions: action servers.
        services: services that the control loop answers.
        readers: those of them that change nothing.
        pictures: topics of cameras, with large messages; see `pictures.py`.
    """

    published: Mapping[str, str]
    latched: frozenset[str]
    received: Mapping[str, str]
    actions: Mapping[str, str]
    services: Mapping[str, str]
    readers: frozenset[str]
    pictures: tuple[str, ...] = ()

    @property
    def topics(self) -> dict[str, str]:
        """All topics, out and in."""
        return {**self.published, **self.received}


def goal_type(action_type: str) -> str:
    """`control_msgs/FollowJointTrajectory_Goal` of `control_msgs/action/FollowJointTrajectory`."""
    return f"{action_type.replace('/action/', '/')}_Goal"


def request_type(service_type: str) -> str:
    """`controller_manager_msgs/SwitchController_Request` of `controller_manager_msgs/srv/SwitchController`."""
    return f"{service_type.replace('/srv/', '/')}_Request"
