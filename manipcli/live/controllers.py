"""Services of the controller manager: list_controllers and switch_controller."""

from __future__ import annotations

from typing import Any, Final

from manipcli.control.manager import ControllerManager
from manipcli.live.command import Values
from manipcli.record.json_message import definition, from_json

BEST_EFFORT: Final = 1
_STATE = definition("controller_manager_msgs/ControllerState")


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
