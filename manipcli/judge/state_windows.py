"""State windows from the spans of a recording, in the joint and body order of robot and scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from manipcli.conditions.condition import Seen
from manipcli.conditions.robustness import NotEvaluated
from manipcli.conditions.state_window import Reference, StateWindow, StepTime, Touching
from manipcli.core.geometry import Array
from manipcli.judge.verdict import StepOutcome
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.record.channels import CONTACTS, SENSORS, TF
from manipcli.record.recording import Recording, Span
from manipcli.scene.scene import Scene

MOST_TICKS: Final = 1_000_000
"""Most control ticks in a span of about half a second; a log with more is damaged and not expanded."""


@dataclass(frozen=True, slots=True)
class Order:
    """Indices of the robot's joints and of the scene's movable bodies in the recorded arrays.

    `believed`: the rows, among these bodies, of those with believed poses of their own.
    """

    joints: list[int]
    bodies: list[int]
    believed: list[int]

    @staticmethod
    def of(recording: Recording, robot: RobotModel, scene: Scene) -> Order | NotEvaluated:
        """The indices, or what is missing in the recording."""
        bodies = tuple(body.name for body in scene.movable)
        for kind, wanted, there in (
            ("joint", robot.joint_names, recording.joint_names),
            ("body", bodies, recording.body_names),
        ):
            missing = [name for name in wanted if name not in there]
            if missing:
                return NotEvaluated(f"the recording has no {kind} '{missing[0]}'")
        return Order(
            [recording.joint_names.index(name) for name in robot.joint_names],
            [recording.body_names.index(name) for name in bodies],
            [bodies.index(name) for name in recording.believed_names if name in bodies],
        )

    def applied(self, s: WorldState) -> WorldState:
        """The states in the order of robot and scene."""
        joints, bodies = self.joints, self.bodies
        return WorldState(
            time=s.time,
            position=s.position[:, joints],
            velocity=s.velocity[:, joints],
            effort=s.effort[:, joints],
            body_position=s.body_position[:, bodies],
            body_quat_xyzw=s.body_quat_xyzw[:, bodies],
            body_linear=s.body_linear[:, bodies],
            body_angular=s.body_angular[:, bodies],
        )

    def belief(self, states: WorldState, believed: Array) -> WorldState | None:
        """Ordered states with the believed poses (T, k, 7) of a span; None: they are the true ones."""
        if not self.believed or not believed.size:
            return None
        position, quat = states.body_position.copy(), states.body_quat_xyzw.copy()
        position[:, self.believed], quat[:, self.believed] = believed[..., :3], believed[..., 3:]
        return replace(states, body_position=position, body_quat_xyzw=quat)


def unrecorded(recording: Recording) -> dict[Seen, str]:
    """Why bodies, contacts, references or sensors are unknown: the task excludes them, or the log lost them."""
    absent: dict[Seen, list[str]] = {
        "bodies": [topic for topic in recording.absent if topic == TF],
        "contacts": [topic for topic in recording.absent if topic == CONTACTS],
        "references": [topic for topic in recording.absent if topic.endswith("/controller_state")],
        "sensors": [topic for topic in recording.absent if topic.startswith(f"{SENSORS}/")],
    }
    found = {
        seen: f"the log has no {topics[0]}: the task's `record:` excludes it"
        for seen, topics in absent.items()
        if topics
    }
    if CONTACTS in recording.silent:
        found["contacts"] = f"{recording.unknown(CONTACTS)}, though every run records contacts"
    return found


def at_every_tick(window: StateWindow, since: StateWindow | None, period: float) -> StateWindow:
    """The window of a thinned log at every control tick, with NaN states, for conditions that use no states.

    Args:
        window: of a span.
        since: the result for the span before; None for the first.
        period: control period [s]; 0: unknown, and the window is returned as it is.
    """
    if not period:
        return window
    last = round(float(window.times[-1]) / period)
    first = round(float(window.times[0]) / period) if since is None else round(float(since.times[-1]) / period) + 1
    count = last - first + 1
    if count <= len(window.times) or count > MOST_TICKS:
        return window
    times = np.round(np.arange(first, last + 1) * period, 9)
    unknown = window.states.map(lambda a: np.broadcast_to(np.nan, (count, *a.shape[1:])))
    before = None if since is None else since.states.map(lambda a: a[-1])
    return replace(window, states=replace(unknown, time=times), before=before, references=(), belief=None)


class WindowsOfSpans:
    """Converts successive spans to state windows, with the last state, contacts and readings of the span before."""

    def __init__(self, order: Order, steps: Sequence[StepOutcome]) -> None:
        self._order = order
        self._steps = tuple(
            StepTime(step.id, step.started, step.ended, "" if step.ended is None else step.outcome) for step in steps
        )
        self._last: StateWindow | None = None

    def next(self, span: Span) -> StateWindow:
        """The window of a span with at least one tick."""
        held = self._last.contacts[-1:] if self._last is not None else ()
        last_believed = None if self._last is None else self._last.belief
        self._last = StateWindow(
            states=self._order.applied(span.states),
            before=None if self._last is None else self._last.states.map(lambda a: a[-1]),
            references=tuple(Reference(trace.joints, trace.reference_position) for trace in span.controllers),
            contacts=(*held, *(Touching(change.time, change.contacts) for change in span.contacts)),
            steps=self._steps,
            readings=span.readings
            if self._last is None
            else {name: self._last.readings[name].then(more) for name, more in span.readings.items()},
        )
        believed = self._order.belief(self._last.states, span.believed)
        if believed is not None:
            before = None if last_believed is None else last_believed.states.map(lambda a: a[-1])
            self._last = replace(self._last, belief=replace(self._last, states=believed, before=before))
        return self._last
