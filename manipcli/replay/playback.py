"""A run sampled for display: states, steps and curves, the input of pages, pictures and videos."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from manipcli.core.geometry import Array, wrapped
from manipcli.judge.margin_curves import MarginCurve
from manipcli.judge.verdict import Verdict
from manipcli.model.batch_kinematics import tool_poses
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.record.gaps import Gaps, gaps_text
from manipcli.record.recording import TaskEvent
from manipcli.render.placing import Placing, Poses
from manipcli.replay.cause import Cause
from manipcli.replay.sensed import Sensed
from manipcli.scene.scene import Scene

RATE = 50.0
"""Default sampling rate of a playback [Hz]."""


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of a step, from `start` to `end` [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class PlaybackStep:
    """A started step with its judged outcome; `end` [s] is the end of the log if the step did not end."""

    id: str
    verb: str
    label: str
    start: float
    end: float
    outcome: str
    text: str = ""
    phases: tuple[Phase, ...] = ()


@dataclass(frozen=True, slots=True)
class PlotTable:
    """Curves over one time axis.

    Attributes:
        name: quantity, `joint position`.
        columns: name of each column: a joint, an axis, a contact pair.
        units: unit of each column.
        times: (T,) [s].
        values: (T, c); NaN if missing.
    """

    name: str
    columns: tuple[str, ...]
    units: tuple[str, ...]
    times: Array
    values: Array


@dataclass(frozen=True)
class Playback:
    """A run at the sampling rate of a display.

    Attributes:
        name: the task; the file name if the task is unknown.
        robot: the robot; None if the log has no description.
        scene: the scene; None if the log has only the robot.
        joint_names: (n) names of `robot.moving_joints`; without a robot, the joints in the log.
        times: (T,) [s], at least one; ticks nearest to the sampling rate, including the first and the last.
        position, velocity, effort: (T, n) as measured; NaN if missing.
        reference: (T, n) reference positions; NaN for a joint without a controller.
        body_position: (T, m, 3) [m] positions of `Scene.movable` in the world.
        body_quat_xyzw: (T, m, 4) orientations.
        contacts: for each time the contacts since the previous time, with the largest force of each pair.
        contact_times: for each time when these contacts were recorded [s], not after it.
        steps: steps in the order of their start.
        verdict: the verdict; None if the log cannot be judged.
        causes: why the run did not pass, the first cause first.
        margins: margins of the expectations over time, of those that have any.
        events: events of the task.
        lost: why the end of the log is missing, or None.
        notes: what is missing or differs from the run, one sentence each.
        begin: log time of t = 0 [ns].
        gaps: start and end [s] of the times without data, at which nothing is known to move; both are among `times`.
        period: of the control tick [s]; None for a log of another program.
        sensed: reads what the sensors measured, for a drawing with these frames.
        keep: owner of resources with the same lifetime: the folder of embedded meshes.
    """

    name: str
    robot: RobotModel | None
    scene: Scene | None
    joint_names: tuple[str, ...]
    times: Array
    position: Array
    velocity: Array
    effort: Array
    reference: Array
    body_position: Array
    body_quat_xyzw: Array
    contacts: tuple[tuple[Contact, ...], ...]
    contact_times: tuple[tuple[float, ...], ...]
    steps: tuple[PlaybackStep, ...] = ()
    verdict: Verdict | None = None
    causes: tuple[Cause, ...] = ()
    margins: tuple[MarginCurve, ...] = ()
    events: tuple[TaskEvent, ...] = ()
    lost: str | None = None
    notes: tuple[str, ...] = ()
    begin: int = 0
    gaps: Gaps = ()
    period: float | None = None
    sensed: Callable[[Collection[str]], Sensed] = field(repr=False, default=lambda frames: Sensed())
    keep: object = field(repr=False, default=None)

    @property
    def start(self) -> float:
        """First time [s]."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Last time [s]."""
        return float(self.times[-1])

    @property
    def has_reference(self) -> bool:
        """Whether there is a robot and any joint has a reference."""
        return self.robot is not None and not bool(np.isnan(self.reference).all())

    @property
    def total(self) -> int:
        """Number of steps, including those that did not start."""
        return max(len(self.steps), 0 if self.verdict is None else len(self.verdict.steps))

    def index(self, time: float) -> int:
        """Index of the time nearest to `time` [s]."""
        k = int(np.searchsorted(self.times, time))
        if k == len(self.times) or (k > 0 and time - self.times[k - 1] <= self.times[k] - time):
            k -= 1
        return max(k, 0)

    def step_at(self, time: float) -> PlaybackStep | None:
        """The active step at `time` [s]; None between steps."""
        return next((step for step in reversed(self.steps) if step.start <= time <= step.end), None)

    @cached_property
    def stance(self) -> Array:
        """(T, n) drawn joint positions: as measured, gaps filled with the previous or else the first measurement, 0
        without any."""
        return filled(self.position)

    def poses(self) -> Poses:
        """Poses of the frames of `draw(robot, scene)` at every time."""
        return Placing(self.robot, self.scene).at(self.stance, self.body_position, self.body_quat_xyzw)

    def reference_position(self) -> Array:
        """(T, n) reference positions; as measured for joints without a controller; mimic joints follow their leader."""
        assert self.robot is not None
        return with_mimics(self.robot, np.where(np.isnan(self.reference), self.stance, self.reference))

    def tool_path(self) -> Array:
        """(T, 3) origin of the tool in the world [m]; (0, 3) for a robot without a tool."""
        if self.robot is None or self.robot.tool is None:
            return np.zeros((0, 3))
        return tool_poses(self.robot, self.stance)[0]

    def curves(self) -> tuple[PlotTable, ...]:
        """Joint states, references and errors, tool position and contact forces; columns without values are left out.

        The error of a joint without limits is the shorter rotation.
        """
        joints = self.robot.joints if self.robot is not None else ()
        kinds = {joint.name: joint.type for joint in joints}
        position = tuple("m" if kinds.get(name) == "prismatic" else "rad" for name in self.joint_names)
        velocity = tuple(f"{unit}/s" for unit in position)
        effort = tuple("N" if unit == "m" else "N m" for unit in position)
        error = self.reference - self.position
        endless = [k for k, name in enumerate(self.joint_names) if kinds.get(name) == "continuous"]
        error[:, endless] = wrapped(error[:, endless])
        tables = []
        for title, values, units in (
            ("joint position", self.position, position),
            ("joint velocity", self.velocity, velocity),
            ("joint effort", self.effort, effort),
            ("joint reference", self.reference, position),
            ("joint error", error, position),
        ):
            known = np.flatnonzero(~np.isnan(values).all(axis=0)).tolist()
            if known:
                columns, of = (tuple(names[k] for k in known) for names in (self.joint_names, units))
                tables.append(PlotTable(title, columns, of, self.times, values[:, known]))
        if self.robot is not None and self.robot.tool is not None:
            path = tool_poses(self.robot, self.position)[0]
            tables.append(PlotTable("tool position", ("x", "y", "z"), ("m",) * 3, self.times, path))
        return (*tables, *self._force_curves())

    def _force_curves(self) -> tuple[PlotTable, ...]:
        """Normal force [N] of every pair in contact at some time; 0 without contact."""
        pairs = {
            pair: k
            for k, pair in enumerate(
                sorted({(contact.a, contact.b) for contacts in self.contacts for contact in contacts})
            )
        }
        if not pairs:
            return ()
        values = np.zeros((len(self.times), len(pairs)))
        for k, contacts in enumerate(self.contacts):
            for contact in contacts:
                values[k, pairs[contact.a, contact.b]] = contact.force
        columns = tuple(f"{a.removeprefix('robot/')} – {b.removeprefix('robot/')}" for a, b in pairs)
        return (PlotTable("contact force", columns, ("N",) * len(pairs), self.times, values),)


def gap_notes(gaps: Gaps) -> tuple[str, ...]:
    """What is shown in gaps, one sentence; none without gaps."""
    return (f"no data from {gaps_text(gaps)}: the state before is held",) if gaps else ()


def filled(values: Array) -> Array:
    """(T, c) with NaN replaced by the previous value, else by the first value, else by 0."""
    known = ~np.isnan(values)
    if known.all():
        return values
    last = np.maximum.accumulate(np.where(known, np.arange(len(values))[:, None], known.argmax(axis=0)), axis=0)
    return np.nan_to_num(np.take_along_axis(values, last, axis=0))
