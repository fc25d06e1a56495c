"""Services and the action of simulation_interfaces 2.1.0 that play, pause, step, reset and end the simulation.

Their names have no prefix, as in Isaac Sim and O3DE. One step is one control tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from manipcli.control.controller import Controller
from manipcli.core.version import __version__
from manipcli.live.command import SEND_GOAL, Answer, Command, Values
from manipcli.live.endpoint import Endpoint
from manipcli.live.live_robot import LiveRobot
from manipcli.live.names import GoalStatus, Result
from manipcli.live.play_state import FIRST, PAUSED, PLAYING, QUITTING, SET_STATE, STATES, STOPPED, Reset
from manipcli.task.task import Task

PACKAGE: Final = "simulation_interfaces"
ALREADY: Final = 101
INCORRECT: Final = 103
"""Further codes of SetSimulationState."""
WHOLE: Final = (0, 3, 7, 255)
"""Scopes of a reset of time and state; nothing is spawned that could stay."""
EACH_STEP: Final = 100
"""Goals of at most this many steps have feedback after each of them, others at 20 Hz of simulated time."""
FEATURES: Final = {
    "ENTITY_TAGS": 4, "ENTITY_CATEGORIES": 8, "ENTITY_STATE_GETTING": 10, "ENTITY_STATE_SETTING": 11,
    "ENTITY_INFO_GETTING": 12, "SIMULATION_RESET": 20, "SIMULATION_STATE_GETTING": 24,
    "SIMULATION_STATE_SETTING": 25, "SIMULATION_STATE_PAUSE": 26, "STEP_SIMULATION_SINGLE": 31,
    "STEP_SIMULATION_MULTIPLE": 32, "STEP_SIMULATION_ACTION": 33,
}  # fmt: skip
"""Of simulation_interfaces/SimulatorFeatures."""


def endpoints(task: Task, controllers: Sequence[Controller]) -> Sequence[Endpoint]:
    """All of them."""

    def service(name: str, kind: str, handle: Any, *, reads: bool = False) -> Endpoint:
        return Endpoint("service", name, f"{PACKAGE}/srv/{kind}", handle, reads)

    return (
        service("/get_simulator_features", "GetSimulatorFeatures", _features, reads=True),
        service("/get_simulation_state", "GetSimulationState", _state, reads=True),
        service(SET_STATE, "SetSimulationState", _set_state),
        service("/reset_simulation", "ResetSimulation", _reset),
        service("/step_simulation", "StepSimulation", _step),
        Endpoint("action", "/simulate_steps", f"{PACKAGE}/action/SimulateSteps", _step),
    )


def result(code: int = Result.OK, text: str = "", **values: object) -> Values:
    """A response with a simulation_interfaces/Result."""
    return {"result": {"result": code, "error_message": text}, **values}


def _features(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    simulation = robot.task.spec.simulation
    info = (
        f"manipcli {__version__}, simulation_interfaces 2.1.0, engine {simulation.engine}. One step is one control "
        f"tick of {1000 * simulation.control_period:g} ms. No spawning: the set of bodies of a log is fixed. A reset "
        "ends the log and begins the next."
    )
    return {"features": {"features": [*FEATURES.values()], "spawn_formats": [], "custom_info": info}}


def _state(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values:
    return result(state={"state": robot.play.state})


def _set_state(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values | None:
    play, target = robot.play, request["state"]["state"]
    if target not in STATES:
        known = ", ".join(f"{number} {name}" for number, name in STATES.items())
        return result(INCORRECT, f"there is no state {target}; states: {known}")
    if command.id == FIRST:
        play.state = target
    elif target == play.state:
        return result(ALREADY, f"the simulation is {STATES[target]} already")
    elif target == STOPPED:
        _restart(robot, command, STOPPED)
        return None
    elif target == QUITTING:
        play.end()
    else:
        play.state, play.steps = target, 0
    return result()


def _reset(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values | None:
    scope = request["scope"]
    if scope not in WHOLE:
        return result(
            Result.UNSUPPORTED, f"a reset of scope {scope} is not supported; time and state are reset together: 0"
        )
    _restart(robot, command, robot.play.state)
    return None


def _restart(robot: LiveRobot, command: Command, state: int) -> None:
    """The response follows when the next session has begun."""
    robot.play.end(Reset(state, lambda: command.answer(Answer(True, result()))))


def _step(robot: LiveRobot, command: Command, request: dict[str, Any]) -> Values | None:
    """Both the service and the action; the response follows after the last tick."""
    play, steps = robot.play, request["steps"]
    why = ""
    if play.state == PLAYING:
        why = "the simulation is playing; pause it before a step"
    elif play.steps:
        why = f"{play.steps} steps of another request remain"
    if why or not steps:
        code = Result.FAILED if why else Result.OK
        status = None if command.op != SEND_GOAL else GoalStatus.ABORTED if why else GoalStatus.SUCCEEDED
        command.answer(Answer(True, result(code, why), status=status))
        return None
    play.state, play.steps = PAUSED, steps
    robot.goals.append(Steps(robot, command, steps))
    return None


@dataclass(slots=True)
class Steps:
    """Steps that are being simulated, for the service or the action; `done`: those simulated."""

    robot: LiveRobot
    command: Command
    steps: int
    done: int = 0

    def cancel(self) -> None:
        self.robot.play.steps = 0
        self.robot.goals.remove(self)  # no tick follows that could send the result
        self.command.answer(self._ended(GoalStatus.CANCELED, "canceled"))

    def step(self, *, due: bool) -> Answer | None:
        self.done += 1
        if self.robot.play.state == PLAYING:
            return self._ended(GoalStatus.ABORTED, "the simulation was set to play")
        if self.done == self.steps:
            return Answer(True, result(), status=GoalStatus.SUCCEEDED)
        if self.command.op != SEND_GOAL or not (due or self.steps <= EACH_STEP):
            return None
        return Answer(True, {"completed_steps": self.done, "remaining_steps": self.steps - self.done})

    def _ended(self, status: GoalStatus, why: str) -> Answer:
        return Answer(True, result(Result.FAILED, f"{why} after {self.done} of {self.steps} steps"), status=status)
