"""What binds a planned motion, how near it comes to each limit, and its manipulability."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.motion_constraints import keeps_of
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planned_states import PlannedStates, planned_states
from manipcli.plan.planner import Planner
from manipcli.plan.trajectory import JointTrajectory

BINDS = 0.95
"""A limit binds while at least this share of it is used (of the scaled limit, for a motion below full speed)."""
PERIOD = 0.01
"""[s] between the examined states."""


@dataclass(frozen=True, slots=True)
class Margin:
    """The joint that comes nearest to one kind of limit.

    Attributes:
        joint, quantity: `position`, `velocity`, `acceleration`, `jerk` or `torque`; for a constraint on the timing, its
            key under `keep`, of the `tool` or the `contents`.
        used: share of the limit; of a position, share of the half range around its middle.
        left: distance to the limit, in the unit of the quantity.
        time: in the motion [s].
    """

    joint: str
    quantity: str
    used: float
    left: float
    time: float


@dataclass(frozen=True, slots=True)
class Binding:
    """The limit that binds for the largest `share` of the time of a motion."""

    joint: str
    quantity: str
    share: float


@dataclass(frozen=True, slots=True)
class Manipulability:
    """The smallest singular value of the tool's Jacobian along a motion, and its time [s]."""

    least: float
    time: float


@dataclass(frozen=True, slots=True)
class MotionMargins:
    """Of one motion; nothing for one that has no trajectory."""

    binding: Binding | None = None
    margins: tuple[Margin, ...] = ()
    manipulability: Manipulability | None = None


def motion_margins(planner: Planner, motion: Motion, begins: PlanningState, end: PlanningState) -> MotionMargins:
    """Examines a motion every 10 ms."""
    if motion.trajectory is None or motion.duration <= 0.0:
        return MotionMargins()
    states = planned_states(planner, motion, end, begins=begins, period=PERIOD)
    stated = list(_of_keeps(planner, motion, begins, states))
    used = [*stated, *_used(planner.robot, motion.trajectory, states)]
    margins: dict[str, Margin] = {}
    for quantity, joint, times, fraction, limit in used:
        k = int(np.argmax(fraction))
        margin = Margin(joint, quantity, float(fraction[k]), float((1.0 - fraction[k]) * limit), float(times[k]))
        if quantity not in margins or margin.used > margins[quantity].used:
            margins[quantity] = margin
    return MotionMargins(
        _binding(used, margins, {one[0] for one in stated}), tuple(margins.values()), _manipulability(planner, states)
    )


Used = tuple[str, str, Array, Array, float]
"""Quantity, joint, times (T), used share of the limit (T), and the limit."""


def _used(robot: RobotModel, trajectory: JointTrajectory, states: PlannedStates) -> Iterator[Used]:
    times = states.times
    jerk = np.diff(states.acceleration, axis=0) / np.maximum(np.diff(times), 1e-9)[:, None]
    for k, name in zip(robot.indices(trajectory.names), trajectory.names, strict=True):
        limits = robot.joint(name).limits
        if limits.lower is not None and limits.upper is not None and np.isfinite(limits.upper - limits.lower):
            half = 0.5 * (limits.upper - limits.lower)
            if half > 0.0:
                middle = 0.5 * (limits.upper + limits.lower)
                yield "position", name, times, np.abs(states.position[:, k] - middle) / half, half
        for quantity, at, values, limit in (
            ("velocity", times, states.velocity, limits.velocity if trajectory.velocities is not None else None),
            ("acceleration", times, states.acceleration, limits.acceleration),
            ("jerk", times[:-1], jerk, limits.jerk if len(jerk) else None),
            ("torque", times, states.torque, limits.effort),
        ):
            if limit and np.isfinite(limit) and (quantity == "velocity" or trajectory.accelerations is not None):
                yield quantity, name, at, np.abs(values[:, k]) / limit, float(limit)


def _of_keeps(planner: Planner, motion: Motion, begins: PlanningState, states: PlannedStates) -> Iterator[Used]:
    """Bounds on the timing that the step states."""
    trajectory = motion.trajectory
    if trajectory is None or trajectory.accelerations is None:
        return
    columns = planner.robot.indices(trajectory.names)
    q, v, a = (each[:, columns] for each in (states.position, states.velocity, states.acceleration))
    dynamics = PathDynamics(planner, begins, trajectory.names)
    for kept in keeps_of(planner, begins, motion.label):
        if kept.bound is not None:
            bound = kept.bound(dynamics)
            yield bound.name, bound.subject, states.times, bound.used(q, v, a), bound.limit


def _binding(used: list[Used], margins: dict[str, Margin], stated: Collection[str]) -> Binding | None:
    """Each state counts for the limit that is used most there, if it binds; `stated`: the quantities under `keep`."""
    timed = [one for one in used if one[0] != "position"]
    scaled = max((margins[q].used for q in ("velocity", "acceleration") if q in margins), default=1.0)
    if any(margins[quantity].used >= BINDS for quantity in stated):
        scaled = 1.0  # it, and no `velocity_scaling`, may be what keeps the joints slow
    if not timed or scaled <= 0.0:
        return None
    count = max(len(one[3]) for one in timed)
    rows = np.zeros((len(timed), count))
    for k, (quantity, _, _, fraction, _) in enumerate(timed):
        # `velocity_scaling` scales velocities and accelerations alike.
        rows[k, : len(fraction)] = fraction / (scaled if quantity in ("velocity", "acceleration") else 1.0)
    best = np.argmax(rows, axis=0)
    binds = rows[best, np.arange(count)] >= BINDS
    if not binds.any():
        return None
    counts = np.bincount(best[binds], minlength=len(timed))
    k = int(np.argmax(counts))
    return Binding(timed[k][1], timed[k][0], float(counts[k]) / count)


def _manipulability(planner: Planner, states: PlannedStates) -> Manipulability | None:
    try:
        solver = planner.solver
    except NotPlannable:
        return None
    values = np.array([solver.least_singular_value(q) for q in states.position])
    k = int(np.argmin(values))
    return Manipulability(float(values[k]), float(states.times[k]))
