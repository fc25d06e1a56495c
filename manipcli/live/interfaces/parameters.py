"""Services of parameters: those of each controller as a node of ROS 2, and rosapi's, which roslibpy and roslibjs call.

A parameter of rosapi is `/NODE:NAME`, for example `/arm_controller:gains.joint_1.p`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument
from manipcli.core.text import did_you_mean
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.live_robot import LiveRobot
from manipcli.live.parameter import DOUBLE, FIELDS, INTEGER, NOT_SET, Parameter, Value, change, parameters_of, unknown
from manipcli.record.json_message import definition, from_json
from manipcli.task.task import Task

URDF: Final = "/robot_state_publisher:robot_description"
"""A parameter that clients read to show the robot; ROS 1 has it without a node."""
_VALUE = definition("rcl_interfaces/ParameterValue")
_DESCRIPTOR = definition("rcl_interfaces/ParameterDescriptor")


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those of rosapi, then those of each controller."""
    for word, handle, reads in (
        ("get_param_names", _get_param_names, True), ("has_param", _has_param, True), ("get_param", _get_param, True),
        ("set_param", _set_param, False), ("delete_param", _delete_param, False),
    ):  # fmt: skip
        yield Endpoint("service", f"/rosapi/{word}", f"rosapi_msgs/srv/{_title(word)}", handle, reads=reads)
    for controller in controllers:
        for word, handle, reads in (
            ("list_parameters", _list, True), ("get_parameters", _get, True), ("get_parameter_types", _types, True),
            ("describe_parameters", _describe, True), ("set_parameters", _set, False),
            ("set_parameters_atomically", _set_atomically, False),
        ):  # fmt: skip
            kind = f"rcl_interfaces/srv/{_title(word)}"
            yield Endpoint("service", f"/{controller.name}/{word}", kind, handle, reads=reads)


def _title(word: str) -> str:
    return "".join(map(str.title, word.split("_")))


def _node(command: Command) -> str:
    """The controller whose service is called."""
    return command.name.strip("/").rpartition("/")[0]


def _list(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Names below the prefixes; depth 0: all, 1: without a dot after the prefix."""
    depth = request["depth"]
    found = []
    for name in parameters_of(robot.manager, _node(command)):
        for prefix in request["prefixes"] or [""]:
            below = name.removeprefix(f"{prefix}.") if prefix else name
            is_below = not prefix or name == prefix or below != name
            if is_below and (depth == 0 or below.count(".") < depth):
                found.append(name)
                break
    prefixes = dict.fromkeys(name.rpartition(".")[0] for name in found if "." in name)
    return {"result": {"names": found, "prefixes": [*prefixes]}}


def _get(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """The values; one that does not exist is not set."""
    known = parameters_of(robot.manager, _node(command))
    return {"values": [_value(known.get(name)) for name in request["names"]]}


def _value(parameter: Parameter | None) -> Values:
    """rcl_interfaces/ParameterValue; a bound that is not set is null."""
    if parameter is None or parameter.type == NOT_SET:
        return from_json(_VALUE, {})
    return from_json(_VALUE, {"type": parameter.type}) | {FIELDS[parameter.type]: parameter.value}


def _types(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    known = parameters_of(robot.manager, _node(command))
    return {"types": [known[name].type if name in known else NOT_SET for name in request["names"]]}


def _describe(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    node = _node(command)
    known = parameters_of(robot.manager, node)
    found = []
    for name in request["names"]:
        parameter = known.get(name)
        if parameter is None:
            raise unknown(node, name, known)
        values: Values = {
            "name": name, "type": parameter.type, "description": parameter.description,
            "read_only": parameter.read_only,
        }  # fmt: skip
        if parameter.least is not None and parameter.most is not None:
            values["floating_point_range"] = [{"from_value": parameter.least, "to_value": parameter.most}]
        found.append(from_json(_DESCRIPTOR, values))
    return {"descriptors": found}


def _set(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Each by itself; what is refused is an event, too."""
    each = [_tried(robot, _node(command), [parameter]) for parameter in request["parameters"]]
    return {"results": each}


def _set_atomically(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """All or none."""
    return {"result": _tried(robot, _node(command), request["parameters"])}


def _tried(robot: LiveRobot, node: str, parameters: Sequence[dict[str, Any]]) -> Values:
    """rcl_interfaces/SetParametersResult of a change of these rcl_interfaces/Parameter."""
    try:
        change(robot.manager, node, {each["name"]: _given(robot.manager, node, each) for each in parameters})
    except InvalidArgument as error:
        found = error.findings[0]
        reason = f"{found.message}; {found.hint}" if found.hint else found.message
        robot.event("refused", f"set_parameters of {node}: {reason}", outcome="error")
        return {"successful": False, "reason": reason}
    return {"successful": True, "reason": ""}


def _given(manager: ControllerManager, node: str, parameter: dict[str, Any]) -> Value:
    """The value of a rcl_interfaces/Parameter; as in ROS 2, an integer is not a double."""
    name, kind = parameter["name"], parameter["value"]["type"]
    if kind == NOT_SET:
        return None
    if kind not in FIELDS:
        raise InvalidArgument("LIVE153", f"parameter '{name}': unknown type {kind}; expected 1 to 9")
    known = parameters_of(manager, node).get(name)
    if kind == INTEGER and known is not None and known.type == DOUBLE:
        raise InvalidArgument("LIVE153", f"parameter '{name}' is of type double (3), not integer (2)")
    value: Value = parameter["value"][FIELDS[kind]]
    return value


def _get_param_names(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    manager = robot.manager
    own = [f"/{info.name}:{name}" for info in manager.list() for name in parameters_of(manager, info.name)]
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
    except ValueError:
        message = f"the value of '{request['name']}' is not JSON: {request['value'][:60]!r}"
        raise InvalidArgument("LIVE153", message, hint="give a number, such as 800") from None
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) > 1 << 53:
        value = math.inf
    change(robot.manager, node, {name: value})
    return {"successful": True, "reason": ""}


def _delete_param(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Removes a bound; other parameters of controllers always have a value."""
    node, name = _parts(robot, request["name"])
    change(robot.manager, node, {name: None})
    return {"successful": True, "reason": ""}


def _found(robot: LiveRobot, full: str) -> Parameter:
    if f"/{full.lstrip('/')}" in (URDF, "/robot_description"):
        return Parameter(robot.task.robot.urdf, type=4)
    node, name = _parts(robot, full)
    known = parameters_of(robot.manager, node)
    if name not in known:
        raise unknown(node, name, known)
    return known[name]


def _parts(robot: LiveRobot, full: str) -> tuple[str, str]:
    """Controller and parameter of `/NODE:NAME`."""
    node, colon, name = full.strip().lstrip("/").partition(":")
    if not colon or not node or not name:
        names = [f"/{info.name}:..." for info in robot.manager.list()]
        hint = did_you_mean(full[:80], names) or f"nodes: {', '.join(names)}"
        raise InvalidArgument("LIVE151", f"parameter '{full[:80]}'; expected /NODE:NAME", hint=hint)
    return node, name
