"""A run as it is shown: poses at the rate of a screen, steps and curves. Pages, pictures and videos are made of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from manipcli.core.geometry import Array, wrapped
from manipcli.judge.verdict import Verdict
from manipcli.model.batch_kinematics import tool_poses
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.replay.placing import Placing, Poses
from manipcli.scene.scene import Scene

RATE = 50.0
"""[Hz] at which a run is shown unless somebody asks for another."""


@dataclass(frozen=True, slots=True)
class Phase:
    """A part of a step, from `start` to `end` [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class PlaybackStep:
    """A step that was begun. `outcome` as judged; `end` [s] is that of the log where the step never ended."""

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
        name: what they show, `joint position`.
        columns: what each is of: a joint, an axis, a pair that touches.
        units: of each column.
        times: (T,) [s].
        values: (T, c); NaN where there is none.
    """

    name: str
    columns: tuple[str, ...]
    units: tuple[str, ...]
    times: Array
    values: Array


@dataclass(frozen=True)
class Playback:
    """A run at the rate of a screen.

    Attributes:
        name: the task, or the file where no task is known.
        robot: None where the log does not say what the robot is.
        scene: None where the log says of nothing but the robot.
        joint_names: (n) of `robot.moving_joints`, or those that the log has where there is no robot.
        times: (T,) [s], at least one; those of the ticks nearest to the wanted rate, first and last among them.
        position, velocity, effort: (T, n) as measured; NaN where the log has none.
        reference: (T, n) what the joints should follow; NaN for a joint that no controller moves.
        body_position: (T, m, 3) [m] of `Scene.movable`.
        body_quat_xyzw: (T, m, 4).
        contacts: for each time what touched since the time before, with the largest force of each pair.
        steps: in the order in which they began.
        verdict: None where the log cannot be judged.
        lost: why the end of the log is missing, or None.
        notes: what else is missing or unlike it was in the run, a sentence each.
        keep: what must live as long as this does: the folder of the meshes that the log carries.
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
    steps: tuple[PlaybackStep, ...] = ()
    verdict: Verdict | None = None
    lost: str | None = None
    notes: tuple[str, ...] = ()
    keep: object = field(repr=False, default=None)

    @property
    def start(self) -> float:
        """[s] the first time."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """[s] the last time."""
        return float(self.times[-1])

    @property
    def has_reference(self) -> bool:
        """Whether a controller moves any joint of a robot that is known."""
        return self.robot is not None and not bool(np.isnan(self.reference).all())

    @property
    def total(self) -> int:
        """Of the steps, those that were never begun too."""
        return max(len(self.steps), 0 if self.verdict is None else len(self.verdict.steps))

    def index(self, time: float) -> int:
        """Number of the time nearest to `time` [s]."""
        k = int(np.searchsorted(self.times, time))
        if k == len(self.times) or (k > 0 and time - self.times[k - 1] <= self.times[k] - time):
            k -= 1
        return max(k, 0)

    def step_at(self, time: float) -> PlaybackStep | None:
        """The step that is on at `time` [s]; between two steps, none."""
        return next((step for step in reversed(self.steps) if step.start <= time <= step.end), None)

    @cached_property
    def stance(self) -> Array:
        """(T, n) where the joints are drawn: as measured, without a measurement as they were last, before the first one
        as they are then, and at zero where there is none at all."""
        return filled(self.position)

    def poses(self) -> Poses:
        """Where the frames of `draw(robot, scene)` are at every time."""
        return Placing(self.robot, self.scene).at(self.stance, self.body_position, self.body_quat_xyzw)

    def reference_position(self) -> Array:
        """(T, n) where the joints should be: what no controller moves stands as measured, mimic joints follow."""
        assert self.robot is not None
        return with_mimics(self.robot, np.where(np.isnan(self.reference), self.stance, self.reference))

    def tool_path(self) -> Array:
        """(T, 3) [m] the origin of the tool in the world; (0, 3) where the robot has none."""
        if self.robot is None or self.robot.tool is None:
            return np.zeros((0, 3))
        return tool_poses(self.robot, self.stance)[0]

    def curves(self) -> tuple[PlotTable, ...]:
        """Joints, reference and error, tool, contact forces at the times shown; columns without a number are left out.

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
                columns, of = (tuple(each[k] for k in known) for each in (self.joint_names, units))
                tables.append(PlotTable(title, columns, of, self.times, values[:, known]))
        if self.robot is not None and self.robot.tool is not None:
            path = tool_poses(self.robot, self.position)[0]
            tables.append(PlotTable("tool position", ("x", "y", "z"), ("m",) * 3, self.times, path))
        return (*tables, *self._force_curves())

    def _force_curves(self) -> tuple[PlotTable, ...]:
        """Normal force [N] of every pair that touches at some time; 0 while it does not."""
        pairs = {pair: k for k, pair in enumerate(sorted({(one.a, one.b) for each in self.contacts for one in each}))}
        if not pairs:
            return ()
        values = np.zeros((len(self.times), len(pairs)))
        for k, each in enumerate(self.contacts):
            for one in each:
                values[k, pairs[one.a, one.b]] = one.force
        columns = tuple(f"{a.removeprefix('robot/')} – {b.removeprefix('robot/')}" for a, b in pairs)
        return (PlotTable("contact force", columns, ("N",) * len(pairs), self.times, values),)


def filled(values: Array) -> Array:
    """(T, c) without NaN: each is the value before it, before the first one that, and 0 where there is none at all."""
    known = ~np.isnan(values)
    if known.all():
        return values
    last = np.maximum.accumulate(np.where(known, np.arange(len(values))[:, None], known.argmax(axis=0)), axis=0)
    return np.nan_to_num(np.take_along_axis(values, last, axis=0))
