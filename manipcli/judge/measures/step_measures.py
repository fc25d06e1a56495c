"""Measurements per step: joint and tool travel, largest contact force, work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.judge.verdict import StepOutcome
from manipcli.model.batch_kinematics import tool_poses
from manipcli.model.robot import RobotModel
from manipcli.record.recording import ContactSnapshot, Recording, Span


@dataclass(frozen=True, slots=True)
class StepMeasures:
    """The measurements of a step; None where unknown.

    Attributes:
        id, verb, outcome: of the step.
        duration: [s] simulated.
        turned, slid: total travel of the revolute [rad] and prismatic [m] joints; None without such joints.
        tool: [m] length of the path of the tool's origin.
        force: [N] the largest normal force between two parts.
        touching: these two parts.
        work: [J] sum over the joints of the integral of max(effort * velocity, 0).
    """

    id: str
    verb: str
    outcome: str
    duration: float | None
    turned: float | None
    slid: float | None
    tool: float | None
    force: float | None
    touching: str
    work: float | None


def step_measures(recording: Recording, robot: RobotModel, steps: Sequence[StepOutcome]) -> tuple[StepMeasures, ...]:
    """Measure the steps of a recording, one span in memory at a time."""
    sums = [_Sums(step) for step in steps]
    joints = _Joints(recording, robot)
    held: ContactSnapshot | None = None
    for span in recording.spans:
        if len(span.states.time):
            whole = joints.add(span)
            for step_sums in sums:
                step_sums.add(*whole)
        for change in span.contacts:
            for step_sums in sums:
                step_sums.touch(held, until=change.time)
            held = change
    for step_sums in sums:
        step_sums.touch(held, until=np.inf)
    return tuple(step_sums.measures(joints) for step_sums in sums)


class _Joints:
    """Increments of travel and work between successive ticks."""

    def __init__(self, recording: Recording, robot: RobotModel) -> None:
        self._order = [recording.joint_names.index(name) for name in robot.joint_names]
        kinds = np.array([joint.type == "prismatic" for joint in robot.moving_joints], dtype=bool)
        self._slides, self.turning, self.sliding = kinds, bool((~kinds).any()), bool(kinds.any())
        self._robot = robot
        self.has_tool = robot.tool is not None
        self._last: tuple[Array, ...] | None = None

    def add(self, span: Span) -> tuple[Array, Array]:
        """Interval ends (T,) [s], and (T, 5): starts [s], revolute, prismatic and tool travel, work."""
        states = span.states
        q, power = states.position[:, self._order], (states.effort * states.velocity)[:, self._order]
        point = tool_poses(self._robot, q)[0] if self.has_tool else np.zeros((len(q), 3))
        now = (states.time, q, np.maximum(power, 0.0).sum(axis=1), point)
        if self._last is not None:
            # mypy does not know that the tuple keeps its length of four.
            now = tuple(np.concatenate([a, b]) for a, b in zip(self._last, now, strict=True))  # type: ignore[assignment]
        self._last = tuple(a[-1:] for a in now)
        time, q, power, point = now
        gone = np.abs(np.diff(q, axis=0))
        seconds = np.diff(time)
        columns = (
            time[:-1],
            gone[:, ~self._slides].sum(axis=1),
            gone[:, self._slides].sum(axis=1),
            np.linalg.norm(np.diff(point, axis=0), axis=1),
            (power[1:] + power[:-1]) / 2.0 * seconds,
        )
        return time[1:], np.stack(columns, axis=1)


class _Sums:
    """Sums over the ticks of a step."""

    def __init__(self, step: StepOutcome) -> None:
        self._step = step
        self._start = np.inf if step.started is None else step.started
        self._end = np.inf if step.ended is None else step.ended
        self._sums = np.zeros(4)
        self._newest = self._start
        self._force, self._touching = 0.0, ""

    def add(self, ends: Array, rows: Array) -> None:
        inside = (rows[:, 0] + ends > 2.0 * self._start) & (rows[:, 0] + ends < 2.0 * self._end)
        self._sums += rows[inside, 1:].sum(axis=0)
        if inside.any():
            self._newest = float(ends[inside][-1])

    def touch(self, held: ContactSnapshot | None, *, until: float) -> None:
        """Contacts `held`, valid until `until` [s]."""
        if held is not None and held.time < self._end and until > self._start:
            for contact in held.contacts:
                if contact.force > self._force:
                    self._force, self._touching = contact.force, f"{contact.a}, {contact.b}"

    def measures(self, joints: _Joints) -> StepMeasures:
        step, begun = self._step, self._step.started is not None
        duration = None
        if step.started is not None:
            duration = (self._newest if step.ended is None else step.ended) - step.started
        turned, slid, tool, work = (float(value) if begun and np.isfinite(value) else None for value in self._sums)
        return StepMeasures(
            id=step.id,
            verb=step.verb,
            outcome=step.outcome,
            duration=duration,
            turned=turned if joints.turning else None,
            slid=slid if joints.sliding else None,
            tool=tool if joints.has_tool else None,
            force=self._force if begun else None,
            touching=self._touching,
            work=work,
        )
