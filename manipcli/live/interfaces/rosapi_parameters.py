"""Services of rosapi for parameters, which roslibpy and roslibjs call: `/NODE:NAME`, values as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.core.errors import InvalidArgument
from manipcli.core.text import did_you_mean
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.fields import MAX_NAME
from manipcli.live.live_robot import LiveRobot
from manipcli.live.names import title
from manipcli.live.parameter import STRING, Parameter, change, known, parameter_names
from manipcli.task.task import Task

URDF: Final = "/robot_state_publisher:robot_description"
"""A parameter that clients read to show the robot; ROS 1 has it without a node."""


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those that answer for all controllers."""
    for word, handle, reads in (
        ("get_param_names", _get_param_names, True), ("has_param", _has_param, True), ("get_param", _get_param, True),
        ("set_param", _set_param, False), ("delete_param", _delete_param, False),
    ):  # fmt: skip
        yield Endpoint("service", f"/rosapi/{word}", f"rosapi_msgs/srv/{title(word)}", handle, reads=reads)


def _get_param_names(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    manager = robot.manager
    own = [f"/{info.name}:{name}" for info in manager.list() for name in parameter_names(manager, info.name)]
    return {"names": [URDF, *own]}


def _has_param(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    try:
        _found(robot, request["name"])
    except InvalidArgument:
        return {"exists": False}
    return {"exists": True}


def _get_param(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """The value as JSON."""
    value = _found(robot, request["name"]).value
    return {"value": json.dumps(value), "successful": True, "reason": ""}


def _set_param(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Change a parameter; its value is JSON."""
    node, name = _parts(robot, request["name"])
    try:
        value = json.loads(request["value"])
    except (ValueError, RecursionError):
        message = f"the value of '{request['name'][:80]}' is not JSON: {request['value'][:60]!r}"
        raise InvalidArgument("LIVE153", message, hint="give a number, such as 800") from None
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 1 << 53:
        value = math.inf
    change(robot, node, {name: value})
    return {"successful": True, "reason": ""}


def _delete_param(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Removes a bound; other parameters of controllers always have a value."""
    node, name = _parts(robot, request["name"])
    change(robot, node, {name: None})
    return {"successful": True, "reason": ""}


def _found(robot: LiveRobot, full: str) -> Parameter:
    if f"/{full.lstrip('/')}" in (URDF, "/robot_description"):
        return Parameter(robot.task.robot.urdf, type=STRING)
    node, name = _parts(robot, full)
    return known(robot.manager, node, name)


def _parts(robot: LiveRobot, full: str) -> tuple[str, str]:
    """Controller and parameter of `/NODE:NAME`."""
    node, colon, name = full.strip().lstrip("/").partition(":")
    if not colon or not node or not name or len(full) > MAX_NAME:
        names = [f"/{info.name}:..." for info in robot.manager.list()]
        hint = did_you_mean(full[:80], names) or f"nodes: {', '.join(names)}"
        raise InvalidArgument("LIVE151", f"parameter '{full[:80]}'; expected /NODE:NAME", hint=hint)
    return node, name
