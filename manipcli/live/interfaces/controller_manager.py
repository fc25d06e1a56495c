"""Services of the controller manager, those of ros2_control."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final, get_args

from manipcli.control.chain import takes_references, target_of
from manipcli.control.claims import Claims
from manipcli.control.compliant_arm import complies
from manipcli.control.controller import Controller
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.tunable_gains import gains_in
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.fields import MAX_NAME
from manipcli.live.live_robot import LiveRobot
from manipcli.live.names import title
from manipcli.record.json_message import definition, from_json
from manipcli.spec.controllers import ControllerSpec, Interface
from manipcli.spec.ros.write import type_in_ros, types_in_ros
from manipcli.task.task import Task

BEST_EFFORT: Final = 1
MEASURED: Final = ("position", "velocity", "effort")
"""State interfaces of every joint."""
_CHAINABLE = "controller_interface::ChainableControllerInterface"
_CONTROLLER = "controller_interface::ControllerInterface"
_STATE = definition("controller_manager_msgs/ControllerState")


def endpoints(task: Task, controllers: Sequence[Controller]) -> Iterator[Endpoint]:
    """Those under `/controller_manager`."""
    for handle, name in (
        (list_controllers, "list_controllers"),
        (_list_types, "list_controller_types"),
        (_list_interfaces, "list_hardware_interfaces"),
    ):
        yield _service(name, handle, reads=True)
    for handle, name in (
        (_load, "load_controller"), (_configure, "configure_controller"), (_cleanup, "cleanup_controller"),
        (_unload, "unload_controller"), (_switch, "switch_controller"),
    ):  # fmt: skip
        yield _service(name, handle)


def _service(name: str, handle: Any, *, reads: bool = False) -> Endpoint:
    kind = f"controller_manager_msgs/srv/{title(name)}"
    return Endpoint("service", f"/controller_manager/{name}", kind, handle, reads=reads)


def list_controllers(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """The response of controller_manager_msgs/ListControllers: the loaded controllers."""
    manager = robot.manager
    loaded = manager.list()
    active = [manager[info.name] for info in loaded if manager.is_active(info.name)]
    chained = {target_of(controller) for controller in active}
    found = []
    for info in loaded:
        controller = manager[info.name]
        references = _references(controller)
        target = target_of(controller)
        connections = [{"name": target, "reference_interfaces": list(info.interfaces)}] if target else []
        values = {
            "name": info.name,
            "state": info.state,
            "type": _type(robot.task, controller),
            "update_rate": round(1.0 / (manager.period * info.every)),
            "claimed_interfaces": list(info.claimed),
            "required_command_interfaces": list(info.interfaces),
            "required_state_interfaces": [f"{joint}/{word}" for joint in controller.joints for word in MEASURED],
            "is_chainable": takes_references(controller),
            "is_chained": info.name in chained,
            "reference_interfaces": references,
            "chain_connections": connections,
        }
        found.append(from_json(_STATE, values))
    return {"controller": found}


def _type(task: Task, controller: Controller) -> str:
    """The name in ROS 2 of the type of a controller; `manipcli/TYPE` where ROS has none."""
    spec = task.true.controllers.spec.controllers.get(controller.name)
    if spec is None:  # compliant steps have brought it along
        return "manipcli/compliant_arm" if complies(controller) else "manipcli/felt_force"
    return type_in_ros(spec) or f"manipcli/{spec.type}"


def _references(controller: Controller) -> list[str]:
    """The interfaces of a controller that another may command."""
    if not takes_references(controller):
        return []
    return [f"{controller.name}/{joint}/{word}" for joint in controller.joints for word in controller.references]


def _list_types(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Types of controllers files, by their names in ROS 2; `manipcli/TYPE` where ROS has none."""
    found: dict[str, object] = {}
    for member in CONTROLLERS:
        chainable = member.spec.references is not ControllerSpec.references
        for name in types_in_ros(member.name) or (f"manipcli/{member.name}",):
            found[name] = _CHAINABLE if chainable else _CONTROLLER
    return {"types": [*found], "base_classes": [*found.values()]}


def _list_interfaces(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Interfaces of all moving joints, commands of those that follow no other, and of controllers with references."""
    manager = robot.manager
    active = [manager[info.name] for info in manager.list() if manager.is_active(info.name)]
    claimed = {f"{joint}/{interface}" for joint, interface in Claims.of(active).owners}
    names = dict.fromkeys(_commandable(robot), True)
    for info in manager.list():
        names |= dict.fromkeys(_references(manager[info.name]), manager.is_active(info.name))
    commands = [_interface(name, available, claimed=name in claimed) for name, available in names.items()]
    states = [_interface(f"{joint}/{word}", True) for joint in manager.joints for word in MEASURED]
    return {"command_interfaces": commands, "state_interfaces": states}


def _commandable(robot: LiveRobot) -> list[str]:
    manager = robot.manager
    joints = [joint for joint in manager.joints if joint not in manager.following]
    return [f"{joint}/{word}" for joint in joints for word in get_args(Interface)]


def _interface(name: str, available: bool, *, claimed: bool = False) -> Values:
    return {"name": name, "data_type": "double", "is_available": available, "is_claimed": claimed}


def _name(request: dict[str, Any]) -> str:
    """The controller of a request, shortened: a longer name is none of ours."""
    name: str = request["name"][:MAX_NAME]
    return name


def _load(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Load a controller of the controllers file again, with the gains of the file; it is unconfigured."""
    gains = gains_in(robot.manager.reload(_name(request)))
    if gains is not None:
        gains.reset()
    return {"ok": True}


def _configure(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    robot.manager.configure(_name(request))
    return {"ok": True}


def _cleanup(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    robot.manager.cleanup(_name(request))
    return {"ok": True}


def _unload(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Unload a controller; its channels in the log stay, without messages."""
    robot.manager.unload(_name(request), keep=True)
    return {"ok": True}


def _switch(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    """Carry out a controller_manager_msgs/SwitchController request.

    A strictness of 0 is that of ROS, strict. `timeout` has no effect: a switch happens between two ticks.
    """
    result = robot.manager.switch(
        request["activate_controllers"],
        request["deactivate_controllers"],
        strictness="best_effort" if request["strictness"] == BEST_EFFORT else "strict",
        time=robot.time,
    )
    return {"ok": result.ok, "message": "; ".join(result.messages)}
