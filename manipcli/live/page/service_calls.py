"""Services that the page calls, found in the offer by name or type, and what their answers mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from manipcli.live import command as words
from manipcli.live.command import Answer, Command, nobody
from manipcli.live.names import GoalStatus, Result
from manipcli.live.offer import Offer, request_type
from manipcli.live.play_state import PAUSED, PLAYING
from manipcli.record.json_message import compact, definition, from_json

EMERGENCY_STOP: Final = words.STOP
RELEASE: Final = words.RELEASE
SWITCH: Final = "controller_manager_msgs/srv/SwitchController"
LIST: Final = "controller_manager_msgs/srv/ListControllers"
GET_STATE: Final = "simulation_interfaces/srv/GetSimulationState"
SET_STATE: Final = "simulation_interfaces/srv/SetSimulationState"
STEP_SIMULATION: Final = "simulation_interfaces/srv/StepSimulation"
RESET_SIMULATION: Final = "simulation_interfaces/srv/ResetSimulation"
STEP_TIME: Final = 0.1
"""[s] Of the button Step."""
PLAY, PAUSE, STEP, RESET = "Play", "Pause", "Step", "Reset"
BUTTONS: Final[Mapping[str, tuple[str, Mapping[str, Any]]]] = {
    PLAY: (SET_STATE, {"state": {"state": PLAYING}}),
    PAUSE: (SET_STATE, {"state": {"state": PAUSED}}),
    STEP: (STEP_SIMULATION, {}),
    RESET: (RESET_SIMULATION, {}),
}
"""Buttons of the simulation: the type of a service, and the request."""


def service_of(offer: Offer, kind: str) -> str | None:
    """The name of the service of a type; None if there is none."""
    return next((name for name, type_ in offer.services.items() if type_ == kind), None)


def call(
    offer: Offer, service: str, request: Mapping[str, Any] | None = None, answer: Callable[[Answer], None] = nobody
) -> Command:
    """The command that calls a service; fields that are not in `request` are 0, false or empty."""
    message = from_json(definition(request_type(offer.services[service])), dict(request or {}))
    return Command(words.CALL_SERVICE, service, json=compact(message), answer=answer)


def switch(offer: Offer, controller: str, *, active: bool) -> Command | None:
    """The command that activates or deactivates a controller; None if the offer has none."""
    service = service_of(offer, SWITCH)
    field = "activate_controllers" if active else "deactivate_controllers"
    return None if service is None else call(offer, service, {field: [controller]})


def press(offer: Offer, button: str, period: float) -> Command | None:
    """The command of a button of the simulation; None if the offer has none; `period` [s] of the control loop."""
    kind, request = BUTTONS[button]
    if button == STEP:
        request = {"steps": max(1, round(STEP_TIME / period))}
    service = service_of(offer, kind)
    return None if service is None else call(offer, service, request)


def failure(answer: Answer) -> str | None:
    """Why a command failed; None if it did not. A response can also fail in its own fields."""
    values = answer.values
    if not answer.ok:
        return answer.text or "refused"
    if answer.status not in (None, GoalStatus.SUCCEEDED):
        return str(values.get("error_string") or answer.text) or None
    result = values.get("result")
    if isinstance(result, dict) and result.get("result", Result.OK) != Result.OK:
        return str(result.get("error_message") or "refused")
    if values.get("ok") is False or values.get("success") is False:
        return str(values.get("message") or "refused")
    return None
