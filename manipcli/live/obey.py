"""Commands carried out between two ticks of the control loop, written to the log with their tick."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from manipcli.control.action import ErrorCode, Feedback, GoalHandle, GoalRejected, refuse_inactive
from manipcli.control.roles import is_follower, is_hand
from manipcli.core.errors import ManipcliError
from manipcli.live import command as words
from manipcli.live.command import Answer, Command, Values
from manipcli.live.controllers import list_controllers, switch_controller
from manipcli.live.goals import action_goal, gripper_goal, topic_goal
from manipcli.live.interface import LIST_CONTROLLERS, is_commanded
from manipcli.record.json_message import definition, to_json
from manipcli.record.write.recorder import Recorder
from manipcli.run.observer import FEEDBACK_PERIOD
from manipcli.simulate.session import Session

ABORTED: Final = 6
STATUS: Final = {"succeeded": 4, "canceled": 5, "aborted": ABORTED}
"""action_msgs/GoalStatus of a goal that ended."""


@dataclass(frozen=True, slots=True)
class _Goal:
    id: str
    controller: str
    gripper: bool
    handle: GoalHandle
    answer: Callable[[Answer], None]


class Obedience:
    """Carries out commands.

    Args:
        session: its manager has the controllers.
        recorder: of the session.
        on_goal: called with the controller and the handle of each accepted goal.
    """

    def __init__(self, session: Session, recorder: Recorder, on_goal: Callable[[str, GoalHandle], None]) -> None:
        self._session = session
        self._recorder = recorder
        self._on_goal = on_goal
        self._goals: list[_Goal] = []
        self._feedback_ticks = max(1, round(FEEDBACK_PERIOD / session.period))

    def obey(self, command: Command) -> bool:
        """Carry out a command before the next tick; False if it ends the session."""
        if command.name == LIST_CONTROLLERS:  # changes nothing
            command.answer(Answer(True, list_controllers(self._session.manager)))
            return True
        tick = self._session.ticks
        self._recorder.live_command(tick, op=command.op, name=command.name, id_=command.id, json=command.json)
        if command.op == words.END:
            return False
        try:
            self._carry_out(command, json.loads(command.json))
        except ManipcliError as error:
            found = error.findings[0]
            text = f"{found.message}; {found.hint}" if found.hint else found.message
            self._refuse(command, text, getattr(error, "error_code", ErrorCode.INVALID_GOAL))
        except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
            # A message that no check foresaw must not end the session of the others.
            self._refuse(command, f"{type(error).__name__}: {error}", ErrorCode.INVALID_GOAL)
        return True

    def _carry_out(self, command: Command, message: dict[str, Any]) -> None:
        manager, now = self._session.manager, self._session.time
        if command.op == words.CANCEL_GOAL:
            for goal in self._goals:
                if goal.id == command.id:
                    goal.handle.cancel()
            return
        if command.op == words.CALL_SERVICE:
            command.answer(Answer(True, switch_controller(manager, message, now)))
            return
        name, _, last = command.name.strip("/").rpartition("/")
        controller = manager[name]
        if last == "commands" and is_commanded(controller):
            refuse_inactive(name, any(info.name == name and info.state == "active" for info in manager.list()))
            controller.set_command(message["data"])
        elif is_follower(controller):
            wanted = topic_goal if command.op == words.PUBLISH else action_goal
            self._accepted(command, name, controller.send_goal(wanted(message, now)), gripper=False)
        elif is_hand(controller):
            handle = controller.send_goal(gripper_goal(message, controller.joints))
            self._accepted(command, name, handle, gripper=True)
        else:
            raise GoalRejected("LIVE123", f"controller '{name}' takes no {last}")

    def _accepted(self, command: Command, name: str, handle: GoalHandle, *, gripper: bool) -> None:
        self._on_goal(name, handle)
        if command.op == words.SEND_GOAL:
            self._goals.append(_Goal(command.id, name, gripper, handle, command.answer))

    def _refuse(self, command: Command, text: str, code: ErrorCode) -> None:
        what = f"{command.op} {command.name}: {text}"
        self._recorder.event(
            self._session.ticks, kind="refused", step="", verb="", outcome="error", text=what, place=""
        )
        values: Values = {"error_code": int(code), "error_string": text} if command.op == words.SEND_GOAL else {}
        command.answer(Answer(False, values, text=text, status=ABORTED))

    def after_tick(self) -> None:
        """Send feedback at 20 Hz, and results, to the clients of goals."""
        due = self._session.ticks % self._feedback_ticks == 0
        for goal in [*self._goals]:
            result = goal.handle.result
            if result is None:
                if due:
                    goal.answer(Answer(True, self._feedback(goal)))
                continue
            self._goals.remove(goal)
            if goal.gripper:
                state = self._joint_state(goal.controller, goal.handle.feedback())
                values: Values = {"state": state, "stalled": result.stalled, "reached_goal": result.reached_goal}
            else:
                values = {"error_code": int(result.code), "error_string": result.text}
            goal.answer(Answer(True, values, status=STATUS[result.status]))

    def _feedback(self, goal: _Goal) -> Values:
        """The `feedback` of the message that the log has, by the same encoder."""
        tick = self._session.ticks
        data, kind = self._recorder.feedback_message(tick, goal.controller, goal.handle.feedback())
        values = to_json(definition(kind), data)["feedback"]
        assert isinstance(values, dict)
        return values

    def _joint_state(self, controller: str, feedback: Feedback) -> object:
        data, kind = self._recorder.feedback_message(self._session.ticks, controller, feedback)
        values = to_json(definition(kind), data)["feedback"]
        assert isinstance(values, dict)
        return values["state"]
