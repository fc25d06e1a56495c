"""Services of the controller manager: list_controllers and switch_controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.control.manager import ControllerManager
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.live_robot import LiveRobot
from manipcli.record.json_message import definition, from_json
from manipcli.task.task import Task

LIST_CONTROLLERS: Final = "/controller_manager/list_controllers"
BEST_EFFORT: Final = 1
_STATE = definition("controller_manager_msgs/ControllerState")


def endpoints(task: Task, controllers: Sequence[Controller]) -> Sequence[Endpoint]:
    """Those under `/controller_manager`."""
    return [
        Endpoint(
            "service",
            LIST_CONTROLLERS,
            "controller_manager_msgs/srv/ListControllers",
            lambda robot, command, request: list_controllers(robot.manager),
            reads=True,
        ),
        Endpoint(
            "service",
            "/controller_manager/switch_controller",
            "controller_manager_msgs/srv/SwitchController",
            _switch,
        ),
    ]


def _switch(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    return switch_controller(robot.manager, request, robot.time)


def list_controllers(manager: ControllerManager) -> Values:
    """The response of controller_manager_msgs/ListControllers."""
    rate = round(1.0 / manager.period)
    return {
        "controller": [
            from_json(
                _STATE,
                {
                    "name": info.name,
                    "state": info.state,
                    "type": type(manager[info.name]).__name__,
                    "update_rate": rate,
                    "claimed_interfaces": list(info.claimed),
                    "required_command_interfaces": list(info.interfaces),
                },
            )
            for info in manager.list()
        ]
    }


def switch_controller(manager: ControllerManager, request: dict[str, Any], now: float) -> Values:
    """Carry out a controller_manager_msgs/SwitchController request at `now` [s]; returns its response.

    A strictness of 0 is that of ROS, strict. `timeout` has no effect: a switch happens between two ticks.
    """
    result = manager.switch(
        request["activate_controllers"],
        request["deactivate_controllers"],
        strictness="best_effort" if request["strictness"] == BEST_EFFORT else "strict",
        time=now,
    )
    return {"ok": result.ok, "message": "; ".join(result.messages)}
