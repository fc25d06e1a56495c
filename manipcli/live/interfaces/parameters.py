"""Services of parameters of each controller, those of a node of ROS 2."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final, TypeVar

from manipcli.control.controller import Controller
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.interfaces.controllers import node_of
from manipcli.live.live_robot import LiveRobot
from manipcli.live.names import title
from manipcli.live.parameter import (
    DOUBLE,
    FIELDS,
    INTEGER,
    NOT_SET,
    Parameter,
    Value,
    change,
    known,
    parameter_names,
    parameter_of,
)
from manipcli.record.json_message import definition, from_json
from manipcli.task.task import Task

MOST: Final = 32
"""Most items of one request."""
T = TypeVar("T")
_VALUE = definition("rcl_interfaces/ParameterValue")
_DESCRIPTOR = definition("rcl_interfaces/ParameterDescriptor")


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those of each controller."""
    for controller in controllers:
        for word, handle, reads in (
            ("list_parameters", _list, True), ("get_parameters", _get, True), ("get_parameter_types", _types, True),
            ("describe_parameters", _describe, True), ("set_parameters", _set, False),
            ("set_parameters_atomically", _set_atomically, False),
        ):  # fmt: skip
            kind = f"rcl_interfaces/srv/{title(word)}"
            yield Endpoint("service", f"/{controller.name}/{word}", kind, handle, reads=reads)


def _few(items: list[T]) -> list[T]:
    """
    Raises:
        InvalidArgument: more than a request may have: the control loop waits for it.
    """
    if len(items) > MOST:
        raise InvalidArgument("LIVE155", f"{len(items)} items in one request; expected {MOST} at most")
    return items


def _list(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Names below the prefixes; depth 0: all, 1: without a dot after the prefix."""
    depth = request["depth"]
    found = []
    for name in parameter_names(robot.manager, node_of(command)):
        for prefix in _few(request["prefixes"]) or [""]:
            below = name.removeprefix(f"{prefix}.") if prefix else name
            is_below = not prefix or name == prefix or below != name
            if is_below and (depth == 0 or below.count(".") < depth):
                found.append(name)
                break
    prefixes = dict.fromkeys(name.rpartition(".")[0] for name in found if "." in name)
    return {"result": {"names": found, "prefixes": [*prefixes]}}


def _get(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """The values; one that does not exist is not set."""
    node = node_of(command)
    return {"values": [_value(parameter_of(robot.manager, node, name)) for name in _few(request["names"])]}


def _value(parameter: Parameter | None) -> Values:
    """rcl_interfaces/ParameterValue; a bound that is not set is null."""
    if parameter is None or parameter.type == NOT_SET:
        return from_json(_VALUE, {})
    return from_json(_VALUE, {"type": parameter.type}) | {FIELDS[parameter.type]: parameter.value}


def _types(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    each = [parameter_of(robot.manager, node_of(command), name) for name in _few(request["names"])]
    return {"types": [NOT_SET if parameter is None else parameter.type for parameter in each]}


def _describe(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    found = []
    for name in _few(request["names"]):
        parameter = known(robot.manager, node_of(command), name)
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
    every = _few(request["parameters"])
    suggest = len(every) == 1
    return {"results": [_tried(robot, node_of(command), [one], suggest=suggest) for one in every]}


def _set_atomically(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """All or none."""
    return {"result": _tried(robot, node_of(command), _few(request["parameters"]))}


def _tried(robot: LiveRobot, node: str, parameters: Sequence[dict[str, Any]], *, suggest: bool = True) -> Values:
    """rcl_interfaces/SetParametersResult of a change of these rcl_interfaces/Parameter."""
    try:
        given = {each["name"]: _given(robot.manager, node, each, suggest=suggest) for each in parameters}
        change(robot, node, given, suggest=suggest)
    except InvalidArgument as error:
        found = error.findings[0]
        reason = f"{found.message}; {found.hint}" if found.hint else found.message
        robot.event("refused", f"set_parameters of {node}: {reason}", outcome="error")
        return {"successful": False, "reason": reason}
    return {"successful": True, "reason": ""}


def _given(manager: ControllerManager, node: str, parameter: dict[str, Any], *, suggest: bool) -> Value:
    """The value of a rcl_interfaces/Parameter; as in ROS 2, an integer is not a double."""
    name, kind = parameter["name"], parameter["value"]["type"]
    if kind == NOT_SET:
        return None
    if kind not in FIELDS:
        raise InvalidArgument("LIVE153", f"parameter '{name}': unknown type {kind}; expected 1 to 9")
    if kind == INTEGER and known(manager, node, name, suggest=suggest).type == DOUBLE:
        raise InvalidArgument("LIVE153", f"parameter '{name}' is of type double (3), not integer (2)")
    value: Value = parameter["value"][FIELDS[kind]]
    return value
