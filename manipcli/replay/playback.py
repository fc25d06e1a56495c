"""A run as it is shown: what stood where at the rate of a screen, its steps, and its curves at the rate of the log.

One value for everything that shows a log: the page in the browser, the page in a file, pictures, films and plots.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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

    def column(self, name: str) -> Array:
        """(T,) one of the curves."""
        return self.values[:, self.columns.index(name)]


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
        tables: reads the curves at the full rate of the log: joints, reference and error, tool, contact forces. Empty
            where it has no more than `curves` shows.
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
    tables: Callable[[], tuple[PlotTable, ...]] = field(repr=False, default=lambda: ())
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

    def reference_poses(self) -> Poses:
        """Where the robot should be, and the bodies as they are: the frames of `draw(robot, scene)` at every time."""
        return Placing(self.robot, self.scene).at(self.reference_position(), self.body_position, self.body_quat_xyzw)

    def tool_path(self) -> Array:
        """(T, 3) [m] the origin of the tool in the world; (0, 3) where the robot has none."""
        if self.robot is None or self.robot.tool is None:
            return np.zeros((0, 3))
        return tool_poses(self.robot, self.stance)[0]

    def curves(self) -> tuple[PlotTable, ...]:
        """Measured and wanted values of the joints, the way of the tool and contact forces, at the times shown."""
        forces = force_table(self.times, self.contacts)
        return (
            *joint_tables(
                self.joint_names, self.robot, self.times, self.position, self.velocity, self.effort, self.reference
            ),
            *((forces,) if forces.columns else ()),
        )


def filled(values: Array) -> Array:
    """(T, c) without NaN: each is the value before it, before the first one that, and 0 where there is none at all."""
    known = ~np.isnan(values)
    if known.all():
        return values
    last = np.maximum.accumulate(np.where(known, np.arange(len(values))[:, None], known.argmax(axis=0)), axis=0)
    return np.nan_to_num(np.take_along_axis(values, last, axis=0))


def joint_tables(
    names: tuple[str, ...],
    robot: RobotModel | None,
    times: Array,
    position: Array,
    velocity: Array,
    effort: Array,
    reference: Array,
) -> tuple[PlotTable, ...]:
    """Measured and wanted values of joints, what is between them, and the way of the tool; columns without a number go.

    Args:
        names: (n) of the joints.
        robot: says the units and where the tool is; None: neither.
        times: (T,) [s].
        position, velocity, effort, reference: (T, n); NaN where there is none.
    """
    slides = {joint.name for joint in robot.joints if joint.type == "prismatic"} if robot is not None else set()
    turning = {joint.name for joint in robot.joints if joint.type == "continuous"} if robot is not None else set()
    endless = [k for k, name in enumerate(names) if name in turning]
    unit = tuple("m" if name in slides else "rad" for name in names)
    error = reference - position
    # A joint without limits errs the short way round.
    error[:, endless] = wrapped(error[:, endless])
    tables = []
    for title, values, units in (
        ("joint position", position, unit),
        ("joint velocity", velocity, tuple(f"{one}/s" for one in unit)),
        ("joint effort", effort, tuple("N" if one == "m" else "N m" for one in unit)),
        ("joint reference", reference, unit),
        ("joint error", error, unit),
    ):
        known = np.flatnonzero(~np.isnan(values).all(axis=0)).tolist() if len(times) else []
        if known:
            columns, of = (tuple(each[k] for k in known) for each in (names, units))
            tables.append(PlotTable(title, columns, of, times, values[:, known]))
    if robot is not None and robot.tool is not None:
        tables.append(PlotTable("tool position", ("x", "y", "z"), ("m",) * 3, times, tool_poses(robot, position)[0]))
    return tuple(tables)


def force_table(times: Array, contacts: Sequence[tuple[Contact, ...]]) -> PlotTable:
    """Normal force of every pair that touches at some time, (T, pairs) [N]; 0 while it does not.

    Args:
        times: (T,) [s].
        contacts: what touches at each.
    """
    pairs = {pair: k for k, pair in enumerate(sorted({(one.a, one.b) for each in contacts for one in each}))}
    values = np.zeros((len(times), len(pairs)))
    for k, each in enumerate(contacts):
        for one in each:
            values[k, pairs[one.a, one.b]] = one.force
    columns = tuple(f"{pair[0].removeprefix('robot/')} – {pair[1].removeprefix('robot/')}" for pair in pairs)
    return PlotTable("contact force", columns, ("N",) * len(pairs), times, values)
