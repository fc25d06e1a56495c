"""A goal of an action, sent to a rosbridge server."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from manipcli.live.names import GoalStatus
from manipcli.live.remote import Remote, RemoteFailed


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal ended: a word of `GoalStatus`, and the values of the result."""

    status: str
    values: dict[str, Any]


class RemoteGoal:
    """One goal.

    Args:
        remote: the connection.
        action, kind: name and type of the action.
        goal: its fields; None: all at their defaults.
        feedback: whether the server sends feedback.
    """

    def __init__(self, remote: Remote, action: str, kind: str, goal: object, *, feedback: bool) -> None:
        self._remote, self._action = remote, action
        self._id = remote.id_for("send_action_goal")
        args = {} if goal is None else goal
        remote.send(
            op="send_action_goal", id=self._id, action=action, action_type=kind, args=args, feedback=feedback
        )  # fmt: skip

    def events(self, patience: float | None = None) -> Iterator[dict[str, Any] | GoalResult]:
        """Feedback, and the result as the last.

        Args:
            patience: [s] longest wait for the result; None: no limit.

        Raises:
            RemoteFailed: LIVE191 the goal is refused; LIVE193 no result in time.
        """
        for message in self._remote.received(patience):
            if message.get("id") != self._id:
                continue
            values = message.get("values")
            if message.get("op") == "action_feedback" and isinstance(values, dict):
                yield values
            if message.get("op") == "action_result":
                if message.get("result") is False:
                    raise RemoteFailed("LIVE191", f"{self._action}: goal refused: {values}")
                status = message.get("status")
                word = next((each.name for each in GoalStatus if each == status), GoalStatus.UNKNOWN.name)
                yield GoalResult(word, values if isinstance(values, dict) else {})
                return
        raise RemoteFailed("LIVE193", f"{self._action}: no result within {patience:g} s", hint="wait longer: --timeout")

    def cancel(self) -> None:
        """Ask the server to cancel it; its result follows."""
        self._remote.send(op="cancel_action_goal", id=self._id, action=self._action)
