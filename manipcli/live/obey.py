"""Commands carried out between two ticks of the control loop, written to the log with their tick."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from manipcli.control.action import ErrorCode
from manipcli.core.errors import ManipcliError, SimulationFailed
from manipcli.live import command as words
from manipcli.live.command import Answer, Command, Values
from manipcli.live.endpoint import KINDS, Endpoint, Kind
from manipcli.live.live_robot import LiveRobot
from manipcli.live.names import GoalStatus, Result
from manipcli.record.json_message import definition, from_json
from manipcli.run.observer import FEEDBACK_PERIOD


class Obedience:
    """Carries out commands.

    Args:
        robot: that is commanded.
        endpoints: of the robot.
    """

    def __init__(self, robot: LiveRobot, endpoints: Iterable[Endpoint]) -> None:
        self._robot = robot
        self._endpoints: dict[tuple[Kind, str], Endpoint] = {(each.kind, each.name): each for each in endpoints}
        self._feedback_ticks = max(1, round(FEEDBACK_PERIOD / robot.session.period))

    def obey(self, command: Command) -> bool:
        """Carry out a command before the next tick; False if it ends the session."""
        endpoint = self._endpoints.get((KINDS.get(command.op, "topic"), command.name))
        logged = endpoint is None or not endpoint.reads
        if logged:
            tick = self._robot.session.ticks
            self._robot.recorder.live_command(tick, op=command.op, name=command.name, id_=command.id, json=command.json)
        if command.op == words.END:
            return False
        try:
            self._carry_out(command, endpoint, json.loads(command.json))
        except SimulationFailed:
            raise
        except ManipcliError as error:
            found = error.findings[0]
            hint = self._robot.manager.locked or found.hint
            text = f"{found.message}; {hint}" if hint else found.message
            self._refuse(command, text, getattr(error, "error_code", ErrorCode.INVALID_GOAL), logged=logged)
        except Exception as error:  # noqa: BLE001
            # A message that no check foresaw must not end the session of the others.
            self._refuse(command, f"{type(error).__name__}: {error}", ErrorCode.INVALID_GOAL, logged=logged)
        return True

    def _carry_out(self, command: Command, endpoint: Endpoint | None, message: dict[str, Any]) -> None:
        if command.op == words.CANCEL_GOAL:
            for goal in self._robot.goals:
                if goal.command.id == command.id:
                    goal.cancel()
            return
        if endpoint is None:
            raise LookupError(f"the session has no '{command.name}'")
        values = endpoint.handle(self._robot, command, message)
        if values is not None:
            command.answer(Answer(True, values))

    def _refuse(self, command: Command, text: str, code: ErrorCode, *, logged: bool) -> None:
        """Answer, and record it as an event, unless the command is not in the log either."""
        if logged:
            self._robot.event("refused", f"{command.op} {command.name}: {text}", outcome="error")
        values: Values = {"error_code": int(code), "error_string": text} if command.op == words.SEND_GOAL else {}
        command.answer(Answer(False, values, text=text, status=GoalStatus.ABORTED))

    def abort(self, why: str) -> None:
        """End all goals of clients as aborted, and all services that wait."""
        for goal in self._robot.goals:
            endpoint = self._endpoints.get(("action", goal.command.name))
            if endpoint is None:
                goal.command.answer(Answer(False, {}, text=why))
            else:
                goal.command.answer(Answer(True, _aborted(endpoint.type, why), status=GoalStatus.ABORTED))
        self._robot.goals.clear()

    def after_tick(self) -> None:
        """Send feedback at 20 Hz, and results, to the clients of goals."""
        goals = self._robot.goals
        if not goals:
            return
        due = self._robot.session.ticks % self._feedback_ticks == 0
        for goal in [*goals]:
            answer = goal.step(due=due)
            if answer is None:
                continue
            if answer.status is not None:
                goals.remove(goal)
            goal.command.answer(answer)


def _aborted(action: str, why: str) -> Values:
    """The result of a goal of an action that ends with the session: everything 0, and the reason where it has room."""
    empty = from_json(definition(f"{action}_Result"), {})
    known: Values = {"error_code": int(ErrorCode.INVALID_GOAL), "error_string": why}
    if "result" in empty:
        known["result"] = {"result": Result.FAILED, "error_message": why}
    return {name: known.get(name, value) for name, value in empty.items()}
