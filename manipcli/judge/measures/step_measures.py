"""What each step of a recording took: how far joints and tool went, the hardest contact, and the work."""

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
    """One step; None where the log does not say.

    Attributes:
        id, verb, outcome: of the step.
        duration: [s] simulated.
        turned, slid: sum over the joints of how far each went there and back, [rad] and [m]; None without such joints.
        tool: [m] length of the path of the tool's origin.
        force: [N] the greatest normal force between two parts.
        touching: which two.
        work: [J] sum over the joints of the integral of effort times velocity, where that is positive.
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
            for one in sums:
                one.add(*whole)
        for change in span.contacts:
            for one in sums:
                one.touch(held, until=change.time)
            held = change
    for one in sums:
        one.touch(held, until=np.inf)
    return tuple(one.measures(joints) for one in sums)


class _Joints:
    """Ticks of a recording as what is summed up: per tick and the one before it."""

    def __init__(self, recording: Recording, robot: RobotModel) -> None:
        self._order = [recording.joint_names.index(name) for name in robot.joint_names]
        kinds = np.array([joint.type == "prismatic" for joint in robot.moving_joints], dtype=bool)
        self._slides, self.turning, self.sliding = kinds, bool((~kinds).any()), bool(kinds.any())
        self._robot = robot
        self.has_tool = robot.tool is not None
        self._last: tuple[Array, ...] | None = None

    def add(self, span: Span) -> tuple[Array, Array]:
        """Times (T,) at which intervals end, and (T, 5): their begin, and what was turned, slid, moved and done."""
        states = span.states
        q, power = states.position[:, self._order], (states.effort * states.velocity)[:, self._order]
        point = tool_poses(self._robot, q)[0] if self.has_tool else np.zeros((len(q), 3))
        now = (states.time, q, np.maximum(power, 0.0).sum(axis=1), point)
        if self._last is not None:
            # Of four arrays four: mypy does not know how long this tuple is.
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
    """One step on its way."""

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
        """What touched until then."""
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
