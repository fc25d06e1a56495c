"""Action messages of the goals of controllers: status, feedback and result."""

from __future__ import annotations

import uuid
from dataclasses import dataclass, field

import numpy as np

from manipcli.control.action import Feedback, GoalResult
from manipcli.core.geometry import Array
from manipcli.record.cdr import NS_PER_S, CdrWriter
from manipcli.record.channels import ControllerChannel

EXECUTING = 2
_STATUS = {"active": EXECUTING, "succeeded": 4, "canceled": 5, "aborted": 6}
KEPT_NS = 10 * NS_PER_S
"""Time that an ended goal stays in the status list."""
_NONE = np.zeros(0)


@dataclass(slots=True)
class _Goal:
    """A goal: its id, acceptance time, status, and end time."""

    id: bytes
    stamp_ns: int
    status: int = EXECUTING
    ended_ns: int | None = None


@dataclass(slots=True)
class GoalLog:
    """The goals of one controller, numbered from 0; ids depend only on its name and the number."""

    channel: ControllerChannel
    _goals: dict[int, _Goal] = field(default_factory=dict)
    _sent: int = 0

    def sent(self, ns: int) -> int:
        """Add a goal; returns its number."""
        number, self._sent = self._sent, self._sent + 1
        self._goals[number] = _Goal(goal_id(self.channel.name, number), ns)
        return number

    def ended(self, ns: int, number: int, result: GoalResult) -> None:
        """Set the result of a goal."""
        goal = self._goals[number]
        goal.status, goal.ended_ns = _STATUS[result.status], ns

    def status(self, ns: int) -> bytes:
        """action_msgs/GoalStatusArray: active goals and recently ended goals."""
        self._goals = {
            k: goal for k, goal in self._goals.items() if goal.ended_ns is None or ns - goal.ended_ns <= KEPT_NS
        }
        writer = CdrWriter()
        writer.u32(len(self._goals))
        for goal in self._goals.values():
            writer.octets(goal.id)
            writer.time(goal.stamp_ns)
            writer.u8(goal.status)
        return writer.data

    def feedback(self, ns: int, number: int | None, feedback: Feedback) -> bytes:
        """The FeedbackMessage of the controller's action; without a number, with an id of zeros."""
        writer = CdrWriter()
        writer.octets(bytes(16) if number is None else self._goals[number].id)
        if self.channel.action == "gripper_cmd":
            self._joint_state(writer, ns, feedback)
            return writer.data
        writer.header(ns, "")
        writer.texts(self.channel.joints)
        elapsed = max(0, round(feedback.elapsed * NS_PER_S))
        wanted, actual = feedback.desired_velocity, feedback.actual_velocity
        for position, velocity in (
            (feedback.desired, wanted),
            (feedback.actual, actual),
            (feedback.error, wanted - actual if len(wanted) == len(actual) else _NONE),
        ):
            for run in (position, velocity, _NONE, _NONE):
                writer.float64s(run)
            writer.time(elapsed)
        writer.u32(0)
        for _ in range(3):  # no joints with several degrees of freedom
            for _ in range(3):
                writer.u32(0)
            writer.time(0)
        return writer.data

    def result(self, ns: int, result: GoalResult, feedback: Feedback) -> bytes:
        """The GetResult_Response of the controller's action; its status is that of the goal."""
        writer = CdrWriter()
        writer.u8(_STATUS[result.status])
        if self.channel.action == "gripper_cmd":
            self._joint_state(writer, ns, feedback)
            writer.u8(any(stop != "reached" for stop in result.fingers))
            writer.u8(bool(result.fingers) and all(stop == "reached" for stop in result.fingers))
        else:
            writer.i32(int(result.code))
            writer.text(result.text)
        return writer.data

    def _joint_state(self, writer: CdrWriter, ns: int, feedback: Feedback) -> None:
        """sensor_msgs/JointState of the measured joints."""
        writer.header(ns, "")
        writer.texts(self.channel.joints)
        runs: tuple[Array, ...] = (feedback.actual, feedback.actual_velocity, _NONE)
        for run in runs:
            writer.float64s(run)


def goal_id(controller: str, number: int) -> bytes:
    """16 bytes: a UUID of version 5."""
    return uuid.uuid5(uuid.NAMESPACE_URL, f"manipcli:goal/{controller}/{number}").bytes
