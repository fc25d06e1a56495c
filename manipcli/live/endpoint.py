"""Endpoints: the topics, services and actions by which clients command a live robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal

from manipcli.live import command as words
from manipcli.live.command import Command, Values
from manipcli.live.live_robot import LiveRobot

Kind = Literal["topic", "service", "action"]
Handler = Callable[[LiveRobot, Command, dict[str, Any]], Values | None]
"""Carries out a command between two ticks, in the thread of the control loop: (robot, command, its message).

It depends on nothing but the message and the simulation, so that a session is simulated again from its commands. A
service returns the values of its response, or None and answers the command later. An action adds a `Goal` to the goals
of the robot. A ManipcliError refuses the command.
"""
KINDS: Final[dict[str, Kind]] = {words.PUBLISH: "topic", words.CALL_SERVICE: "service", words.SEND_GOAL: "action"}
"""What a command of each op is sent to."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """One of them.

    Attributes:
        kind: what it is.
        name: with a leading slash.
        type: ROS 2 type, such as `std_srvs/srv/Trigger`.
        handle: see `Handler`.
        reads: whether it changes nothing; it then needs no token and is not in the log.
    """

    kind: Kind
    name: str
    type: str
    handle: Handler
    reads: bool = False
