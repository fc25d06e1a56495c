"""Measurements of a whole run: tracking errors, use of limits, work, power, and grasps.

Two passes over the spans, with one span in memory: the first finds the grasps, the second measures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, frozen, wrapped
from manipcli.judge.measures.grasp_intervals import GraspFacts, GraspMeter, find_grasps
from manipcli.judge.measures.reference import references
from manipcli.judge.saturations import Saturations
from manipcli.judge.verdict import StepOutcome
from manipcli.model.robot import RobotModel
from manipcli.record.recording import Recording, Span
from manipcli.scene.scene import Scene

BUCKETS = 240
"""Number of equal parts of the run; the largest error of each is kept."""


@dataclass(frozen=True, slots=True)
class Peak:
    """The largest value, and the first time [s] at which it was reached."""

    value: float
    at: float


@dataclass(frozen=True, slots=True)
class Use:
    """The largest use of a limit.

    Attributes:
        share: of the limit, 1 at the limit; for a position, of the distance from the middle of its range to its limit.
        value, limit: the measured value, and the limit on its side.
        at: [s] time.
    """

    share: float
    value: float
    limit: float
    at: float


@dataclass(frozen=True, slots=True)
class JointFacts:
    """A joint over the whole run; rad or m, N m or N.

    Attributes:
        name: of the joint.
        unit: of its position.
        error: the largest |reference - measured|; None without a recorded reference.
        error_rms: its root mean square.
        position, velocity, effort: use of each limit; None without that limit.
        given, taken: [J] the integrals of its positive and of its negative power, both as positive numbers.
        power: the largest |power| [W].
        saturated: ticks in which its command was limited.
    """

    name: str
    unit: str
    error: Peak | None
    error_rms: float | None
    position: Use | None
    velocity: Use | None
    effort: Use | None
    given: float
    taken: float
    power: Peak
    saturated: int = 0


@dataclass(frozen=True, slots=True)
class StepFacts:
    """A step that started.

    Attributes:
        id: of the step.
        started: [s].
        given, taken: (n,) [J] of each joint; see `JointFacts`.
        power: (n,) [W] the largest |power| of each joint.
        total: the largest sum of the positive powers of the joints [W], and its time.
    """

    id: str
    started: float
    given: Array
    taken: Array
    power: Array
    total: Peak


@dataclass(frozen=True, slots=True)
class RunFacts:
    """The measurements of a run.

    Attributes:
        joints: in the order of `RobotModel.moving_joints`.
        steps: those that started, in order of time.
        holds: grasps, in order of time.
        actuators: saturated ticks by actuator, without actuators that never saturated.
        times: (B,) [s] the middles of equal parts of the run.
        errors: (B, n) the largest |reference - measured| of each joint in each part; NaN without a reference.
        period: [s] control period.
        start, end: [s] of the recording.
    """

    joints: tuple[JointFacts, ...]
    steps: tuple[StepFacts, ...]
    holds: tuple[GraspFacts, ...]
    actuators: tuple[tuple[str, int], ...]
    times: Array
    errors: Array
    period: float
    start: float
    end: float


def run_facts(recording: Recording, robot: RobotModel, scene: Scene, steps: Sequence[StepOutcome]) -> RunFacts:
    """Measure a recording.

    Args:
        recording: a log with every joint of the robot and every movable body of the scene.
        robot, scene: built from the log.
        steps: their outcomes.
    """
    joints = [recording.joint_names.index(name) for name in robot.joint_names]
    bodies = {name: k for k, name in enumerate(recording.body_names)}
    holds, end = find_grasps(recording, scene)
    meters = [GraspMeter(hold, robot, scene, joints) for hold in holds if hold.body in bodies]
    limits = _Limits(robot)
    errors = _Errors(robot, end)
    powers = _Powers(len(joints), steps, end)
    for span in recording.spans:
        if not len(span.states.time):
            continue
        states = span.states
        position, velocity, effort = (a[:, joints] for a in (states.position, states.velocity, states.effort))
        limits.add(states.time, position, velocity, effort)
        errors.add(span, position)
        powers.add(states.time, np.nan_to_num(effort * velocity))
        for meter in meters:
            meter.add(span, bodies)
    saturations = Saturations.from_metadata(recording.metadata, end=end, period=recording.period)
    found = tuple(
        JointFacts(
            name,
            robot.moving_joints[k].unit,
            errors.largest(k),
            errors.rms(k),
            *limits.used(k),
            given=float(powers.given[:, k].sum()),
            taken=float(powers.taken[:, k].sum()),
            power=powers.peak(k),
            saturated=saturations.joints.get(name, 0),
        )
        for k, name in enumerate(robot.joint_names)
    )
    return RunFacts(
        joints=found,
        steps=powers.steps(),
        holds=tuple(meter.finish() for meter in meters),
        actuators=tuple(saturations.actuators.items()),
        times=errors.times,
        errors=errors.table(),
        period=recording.period,
        start=errors.start,
        end=end,
    )


class _Limits:
    """The largest use of the limits of each joint; rows are position, velocity, effort."""

    def __init__(self, robot: RobotModel) -> None:
        nan = float("nan")
        limits = [joint.limits for joint in robot.moving_joints]
        both = [each.lower is not None and each.upper is not None for each in limits]
        # The limits of a continuous joint have no effect.
        both = [had and joint.type != "continuous" for had, joint in zip(both, robot.moving_joints, strict=True)]
        lower = np.array([each.lower if had else nan for each, had in zip(limits, both, strict=True)], dtype=np.float64)
        upper = np.array([each.upper if had else nan for each, had in zip(limits, both, strict=True)], dtype=np.float64)
        stated = [[each.velocity or nan for each in limits], [each.effort or nan for each in limits]]
        self._middle = np.stack([(lower + upper) / 2.0, np.zeros(len(limits)), np.zeros(len(limits))])
        self._half = np.vstack([(upper - lower) / 2.0, np.array(stated, dtype=np.float64).reshape(2, -1)])
        self._half[self._half <= 0.0] = nan
        self._share = np.full(self._half.shape, -np.inf)
        self._value = np.zeros(self._half.shape)
        self._at = np.zeros(self._half.shape)

    def add(self, times: Array, *measured: Array) -> None:
        columns = np.arange(self._half.shape[1])
        for row, values in enumerate(measured):
            away = np.nan_to_num(np.abs(values - self._middle[row]), nan=-np.inf)
            k = np.argmax(away, axis=0)
            share = away[k, columns] / self._half[row]
            more = share > self._share[row]
            self._share[row, more] = share[more]
            self._value[row, more] = values[k, columns][more]
            self._at[row, more] = times[k][more]

    def used(self, joint: int) -> tuple[Use | None, Use | None, Use | None]:
        first, second, third = (self._use(row, joint) for row in range(3))
        return first, second, third

    def _use(self, row: int, joint: int) -> Use | None:
        if not np.isfinite(self._share[row, joint]):
            return None
        value, middle, half = self._value[row, joint], self._middle[row, joint], self._half[row, joint]
        limit = middle + half if value >= middle else middle - half
        return Use(float(self._share[row, joint]), float(value), float(limit), float(self._at[row, joint]))


class _Errors:
    """|reference - measured| of each joint: the largest, the mean square, and the largest in each part of the run."""

    def __init__(self, robot: RobotModel, end: float) -> None:
        n = len(robot.joint_names)
        self._names = robot.joint_names
        self._endless = [k for k, joint in enumerate(robot.moving_joints) if joint.type == "continuous"]
        self.start, self._end = 0.0, end
        self._begun = False
        self._largest = np.full(n, -np.inf)
        self._at = np.zeros(n)
        self._squares, self._count = np.zeros(n), np.zeros(n)
        self._table = np.full((BUCKETS, n), -np.inf)

    def add(self, span: Span, position: Array) -> None:
        times = span.states.time
        if not self._begun:
            self.start, self._begun = float(times[0]), True
        error = references(span.controllers, self._names, len(times)) - position
        # The error of a continuous joint is wrapped to +-pi.
        error[:, self._endless] = wrapped(error[:, self._endless])
        known = np.isfinite(error)
        size = np.where(known, np.abs(error), -np.inf)
        k, columns = np.argmax(size, axis=0), np.arange(size.shape[1])
        more = size[k, columns] > self._largest
        self._largest[more], self._at[more] = size[k, columns][more], times[k][more]
        self._squares += np.square(np.where(known, error, 0.0)).sum(axis=0)
        self._count += known.sum(axis=0)
        share = (times - self.start) / max(self._end - self.start, 1e-12)
        part = np.clip((share * BUCKETS).astype(int), 0, BUCKETS - 1)
        np.maximum.at(self._table, part, size)

    @property
    def times(self) -> Array:
        middle = (np.arange(BUCKETS) + 0.5) / BUCKETS
        return frozen(self.start + middle * (self._end - self.start))

    def table(self) -> Array:
        return frozen(np.where(np.isfinite(self._table), self._table, np.nan))

    def largest(self, joint: int) -> Peak | None:
        return Peak(float(self._largest[joint]), float(self._at[joint])) if self._count[joint] else None

    def rms(self, joint: int) -> float | None:
        return float(np.sqrt(self._squares[joint] / self._count[joint])) if self._count[joint] else None


class _Powers:
    """Power of each joint, P = effort * velocity, and its integral by the trapezoidal rule, by step.

    Row s of the tables is the s-th started step; the last row is the time outside of steps.
    """

    def __init__(self, joints: int, steps: Sequence[StepOutcome], end: float) -> None:
        begun = sorted((step for step in steps if step.started is not None), key=lambda step: step.started or 0.0)
        self._ids = [step.id for step in begun]
        self._starts = np.array([step.started or 0.0 for step in begun])
        self._ends = np.array([end if step.ended is None else step.ended for step in begun])
        rows = len(begun) + 1
        self.given, self.taken = np.zeros((rows, joints)), np.zeros((rows, joints))
        self._power = np.zeros((rows, joints))
        self._total = [Peak(0.0, float(start)) for start in (*self._starts, 0.0)]
        self._most = np.zeros(joints)
        self._at = np.zeros(joints)
        self._before: tuple[Array, Array] | None = None

    def add(self, times: Array, power: Array) -> None:
        if self._before is not None:
            times, power = np.concatenate([self._before[0], times]), np.vstack([self._before[1], power])
        else:
            self._peaks(times[:1], power[:1])
        self._before = times[-1:].copy(), power[-1:].copy()
        if len(times) < 2:
            return
        self._peaks(times[1:], power[1:])
        seconds = np.diff(times)[:, None]
        up, down = np.maximum(power, 0.0), np.maximum(-power, 0.0)
        row = self._rows((times[1:] + times[:-1]) / 2.0)
        np.add.at(self.given, row, (up[1:] + up[:-1]) / 2.0 * seconds)
        np.add.at(self.taken, row, (down[1:] + down[:-1]) / 2.0 * seconds)
        np.maximum.at(self._power, row, np.maximum(np.abs(power[1:]), np.abs(power[:-1])))
        together = up.sum(axis=1)
        for each in np.unique(row):
            mine = np.flatnonzero(row == each) + 1
            k = int(mine[np.argmax(together[mine])])
            if together[k] > self._total[each].value:
                self._total[each] = Peak(float(together[k]), float(times[k]))

    def _rows(self, times: Array) -> npt.NDArray[np.intp]:
        """(T,) the row of the step at each time; the last row outside of steps."""
        if not len(self._starts):
            return np.zeros(len(times), dtype=np.intp)
        row = np.searchsorted(self._starts, times, side="right") - 1
        return np.where((row >= 0) & (times <= self._ends[row]), row, len(self._starts)).astype(np.intp)

    def _peaks(self, times: Array, power: Array) -> None:
        size = np.abs(power)
        k, columns = np.argmax(size, axis=0), np.arange(size.shape[1])
        more = size[k, columns] > self._most
        self._most[more], self._at[more] = size[k, columns][more], times[k][more]

    def peak(self, joint: int) -> Peak:
        return Peak(float(self._most[joint]), float(self._at[joint]))

    def steps(self) -> tuple[StepFacts, ...]:
        return tuple(
            StepFacts(name, start, frozen(self.given[k]), frozen(self.taken[k]), frozen(self._power[k]), self._total[k])
            for k, (name, start) in enumerate(zip(self._ids, self._starts.tolist(), strict=True))
        )
