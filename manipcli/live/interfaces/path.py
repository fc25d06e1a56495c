"""Speed of a controller's trajectories: `speed_scaling`, and a stop on the path by `pause` and `resume`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.control.roles import is_scaled
from manipcli.control.speed_scaling import SpeedScaling
from manipcli.core.errors import InvalidArgument
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.interfaces.controllers import controller_of, refuse_unless_active
from manipcli.live.live_robot import LiveRobot
from manipcli.record import schemas
from manipcli.task.task import Task

MOST: Final = 1.0
"""Largest factor: trajectories are checked against the limits at their own speed."""


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those of each controller that follows trajectories; `speed_scaling_input` is the topic of ros2_controllers."""
    for controller in controllers:
        if is_scaled(controller):
            base = f"/{controller.name}"
            yield Endpoint("topic", f"{base}/speed_scaling", "std_msgs/msg/Float64", _scale)
            yield Endpoint("topic", f"{base}/speed_scaling_input", "control_msgs/msg/SpeedScalingFactor", _scale)
            yield Endpoint("service", f"{base}/pause", schemas.TRIGGER, _pause)
            yield Endpoint("service", f"{base}/resume", schemas.TRIGGER, _resume)


def _scaling(robot: LiveRobot, command: Command) -> SpeedScaling:
    controller = controller_of(robot, command)
    assert is_scaled(controller)
    refuse_unless_active(robot, controller)
    return controller.scaling


def _scale(robot: LiveRobot, command: Command, message: dict[str, Any]) -> None:
    (factor,) = message.values()
    if not 0.0 <= factor <= MOST:
        raise InvalidArgument("LIVE150", f"the speed scaling is {factor:g}; expected 0 (stop) to 1 (nominal)")
    _scaling(robot, command).set(factor)


def _pause(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    scaling = _scaling(robot, command)
    was = scaling.paused
    scaling.pause()
    return {"success": True, "message": "paused already" if was else "stops on the path"}


def _resume(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    scaling = _scaling(robot, command)
    was = scaling.paused
    scaling.resume()
    return {"success": True, "message": f"continues with speed scaling {scaling.factor:g}" if was else "not paused"}
