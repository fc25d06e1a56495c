"""Emergency stop: all controllers that command joints are deactivated at once, and their joints are held by brakes.

Only hands stay active and keep their grip, as grippers with self-locking drives do: a brake in PyBullet holds the
joint, not the force that it exerted, so that the object would fall. Goals end as aborted, and a step that moves fails.
Until the release no goal, trajectory or jog is accepted, and no controller can be activated. The release activates the
same controllers, which hold the measured position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.control.roles import Hand, is_hand, takes_goals
from manipcli.core.text import listed
from manipcli.live.command import RELEASE, STOP, Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.live_robot import LiveRobot
from manipcli.record import schemas
from manipcli.task.task import Task

REASON: Final = "emergency stop"
LOCKED: Final = f"the emergency stop is active; release it with the service {RELEASE}"


def endpoints(task: Task, controllers: Sequence[Controller]) -> Sequence[Endpoint]:
    """The services that stop and release."""
    stop = _EmergencyStop()
    return [
        Endpoint("service", STOP, schemas.TRIGGER, stop.stop),
        Endpoint("service", RELEASE, schemas.TRIGGER, stop.release),
    ]


class _EmergencyStop:
    def __init__(self) -> None:
        self._stopped: tuple[str, ...] = ()
        self._hands: list[Hand] = []

    def stop(self, robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
        manager = robot.manager
        if manager.locked:
            return {"success": True, "message": "the emergency stop is already active"}
        active = [manager[info.name] for info in manager.list() if info.state == "active" and info.interfaces]
        self._hands = [controller for controller in active if is_hand(controller)]
        for hand in self._hands:
            hand.halt(robot.time, REASON)
            _accept_goals(hand, yes=False)
        self._stopped = tuple(controller.name for controller in active if not is_hand(controller))
        for name in self._stopped:
            manager[name].deactivate(robot.time, REASON)
        manager.switch(deactivate=self._stopped, strictness="best_effort", time=robot.time)
        manager.locked = LOCKED
        text = f"{REASON}: {listed(self._stopped) or 'no controller'} deactivated, brakes hold the joints"
        if self._hands:
            text += f"; {listed([hand.name for hand in self._hands])} keeps its grip"
        robot.event("emergency_stop", text, outcome="error")
        return {"success": True, "message": text}

    def release(self, robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
        manager = robot.manager
        if not manager.locked:
            return {"success": False, "message": "there is no emergency stop to release"}
        manager.locked = ""
        for hand in self._hands:
            _accept_goals(hand, yes=manager.is_active(hand.name))
        switched = manager.switch(activate=self._stopped, strictness="best_effort", time=robot.time)
        text = "; ".join((f"emergency stop released: {listed(switched.activated)} activated", *switched.messages))
        robot.event("emergency_stop_released", text)
        return {"success": True, "message": text}


def _accept_goals(controller: Controller, *, yes: bool) -> None:
    if takes_goals(controller):
        controller.accepts_goals = yes
