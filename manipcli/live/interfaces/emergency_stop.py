"""Emergency stop: all controllers that command joints are deactivated at once, and their joints are held by brakes.

Goals end as aborted, and so does a step that runs. Until the release no controller can be activated, so that no goal,
trajectory or jog is accepted. The release activates the same controllers again, which hold the measured position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.core.text import listed
from manipcli.live.command import Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.live_robot import LiveRobot
from manipcli.record import schemas
from manipcli.task.task import Task

STOP: Final = "/emergency_stop"
RELEASE: Final = "/emergency_stop_release"
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

    def stop(self, robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
        manager = robot.manager
        if manager.locked:
            return {"success": True, "message": "the emergency stop is already active"}
        self._stopped = tuple(info.name for info in manager.list() if info.state == "active" and info.interfaces)
        for name in self._stopped:
            manager[name].deactivate(robot.time, REASON)
        manager.switch(deactivate=self._stopped, time=robot.time)
        manager.locked = LOCKED
        text = f"{REASON}: {listed(self._stopped) or 'no controller'} deactivated, brakes hold the joints"
        robot.event("emergency_stop", text, outcome="error")
        return {"success": True, "message": text}

    def release(self, robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
        manager = robot.manager
        if not manager.locked:
            return {"success": False, "message": "there is no emergency stop to release"}
        manager.locked = ""
        switched = manager.switch(activate=self._stopped, strictness="best_effort", time=robot.time)
        text = "; ".join((f"emergency stop released: {listed(switched.activated)} activated", *switched.messages))
        robot.event("emergency_stop_released", text)
        return {"success": True, "message": text}
