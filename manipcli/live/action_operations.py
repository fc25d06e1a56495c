"""Operations of a client on actions: send_action_goal, cancel_action_goal.

A goal that ends has `"result": true`, its `status` as in action_msgs/GoalStatus, and its result as `values`, also if it
was aborted. A goal that is refused has `"result": false`, `"status": 0` (unknown) and a text as `values`, as in
rosbridge_suite. Its text begins with ROS's error code, if it has one; the field `error_code` is the number.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from manipcli.control.action import ErrorCode
from manipcli.live import command as words
from manipcli.live.command import Answer
from manipcli.live.connection import Connection
from manipcli.live.fields import MAX_NAME, Refused, arguments, check_type, near, rooted, text_of
from manipcli.live.names import GoalStatus
from manipcli.live.offer import goal_type
from manipcli.record.json_message import definition

MAX_GOALS: Final = 100
"""Active goals of one client."""


class ActionOperations:
    """Those of one client."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._goals: dict[str, str] = {}
        self._sent = 0

    def send_goal(self, frame: Mapping[str, Any]) -> None:
        """Check a goal and hand it to the control loop."""
        name = rooted(text_of(frame, "action"))
        kind = self._connection.offer.actions.get(name)
        if kind is None:
            raise Refused(f"unknown action '{name[:80]}'; {near(name, self._connection.offer.actions)}")
        check_type(name, kind, {"type": frame.get("action_type")})
        id_ = frame.get("id")
        if not isinstance(id_, str) or not id_ or len(id_) > MAX_NAME:
            raise Refused("send_action_goal needs an id, a text")
        if id_ in self._goals:
            raise Refused(f"goal '{id_[:60]}' is still active; each goal needs its own id")
        if len(self._goals) >= MAX_GOALS:
            raise Refused(f"more than {MAX_GOALS} goals are active")
        self._connection.check_right(name)  # before the long check of the message
        message = arguments(definition(goal_type(kind)), frame.get("args", {}))
        self._sent += 1
        own = f"{self._connection.number}.{self._sent}"

        def answered(answer: Answer) -> None:
            if answer.status is not None:
                self._goals.pop(id_, None)
                self.result(frame, answer)
            elif frame.get("feedback") is True:
                found = {"op": "action_feedback", "action": frame["action"], "values": answer.values}
                self._connection.answer(found, id_)

        self._connection.command(words.SEND_GOAL, name, own, message, answered)
        self._goals[id_] = own

    def result(self, frame: Mapping[str, Any], answer: Answer) -> None:
        """Send the result of a goal, or why it was refused."""
        found: dict[str, object] = {"op": "action_result", "action": frame["action"], "values": answer.values}
        found |= {"status": answer.status, "result": True}
        if not answer.ok:
            code = answer.values.get("error_code")
            text = f"{ErrorCode(code).name} ({code}): {answer.text}" if isinstance(code, int) else answer.text
            found |= {"values": text, "status": GoalStatus.UNKNOWN, "result": False}
            found |= {"error_code": code} if isinstance(code, int) else {}
        self._connection.answer(found, frame.get("id"))

    def cancel(self, frame: Mapping[str, Any]) -> None:
        """Cancel an active goal of this client."""
        id_ = text_of(frame, "id")
        if id_ not in self._goals:
            raise Refused(f"goal '{id_[:60]}' is not active")
        name = rooted(text_of(frame, "action"))
        self._connection.command(words.CANCEL_GOAL, name, self._goals[id_], {}, words.nobody)
