"""The endpoints of a live session, and what it offers with them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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
    rosapi_parameters,
    simulation,
    task,
)
from manipcli.live.offer import CLOCK, Offer
from manipcli.record import schemas
from manipcli.record.channels import LIVE_COMMANDS, MeasuredChannel, Recorded, channel_table
from manipcli.task.task import Task

INTERFACES: Final = (
    controllers.endpoints,
    path.endpoints,
    jog.endpoints,
    emergency_stop.endpoints,
    controller_manager.endpoints,
    parameters.endpoints,
    rosapi_parameters.endpoints,
    simulation.endpoints,
    entities.endpoints,
    task.endpoints,
)
"""Groups of endpoints: (task, controllers) -> its endpoints."""


def endpoints_of(task: Task, loaded: Sequence[Controller]) -> tuple[Endpoint, ...]:
    """All endpoints of a robot with these controllers."""
    return tuple(endpoint for interface in INTERFACES for endpoint in interface(task, loaded))


def offer_of(
    endpoints: Iterable[Endpoint], recorded: Sequence[Recorded], sensors: Sequence[MeasuredChannel] = ()
) -> Offer:
    """The offer with these endpoints; `recorded`, `sensors`: channels of controllers and of sensors in the log."""
    table = [channel for channel in channel_table(recorded, sensors=sensors) if channel.topic != LIVE_COMMANDS]
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
        pictures=tuple(sensor.topic for sensor in sensors if not sensor.filled),
    )
