"""What binds a planned motion, how near it comes to each limit, and its manipulability."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.configuration import with_joints, with_mimics
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.motion_constraints import keeps_of
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.trajectory import JointTrajectory

BINDS = 0.95
"""A limit binds while at least this share of it is used (of the scaled limit, for a motion below full speed)."""
EVERY = 0.01
"""[s] between the configurations whose manipulability is examined."""


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


def motion_margins(planner: Planner, motion: Motion, begins: PlanningState) -> MotionMargins:
    """Examines all points of a motion that begins in this state; `planner`: with the constraints of its step."""
    trajectory = motion.trajectory
    if trajectory is None:
        return MotionMargins()
    dynamics = PathDynamics(planner, begins, trajectory.names)
    q, v, a = trajectory.positions, trajectory.velocities, trajectory.accelerations
    torque, stated = None, []
    if v is not None and a is not None:
        torque = dynamics.efforts(q, v, a)
        kept = keeps_of(planner, begins, motion.label)
        bounds = [each.bound(dynamics) for each in kept if each.bound is not None]
        stated = [Used(bound.name, bound.subject, bound.used(q, v, a), bound.limit) for bound in bounds]
    used = (*stated, *limits_used(planner.robot, trajectory, torque))
    margins = nearest_limits(used, trajectory.times)
    slowed = any(float(each.share.max()) >= BINDS for each in stated)
    return MotionMargins(_binding(used, margins, slowed), margins, manipulability(planner, trajectory, begins))


class Used(NamedTuple):
    """The used share of the `limit` of one joint, or of what is under `keep`, at k points; jerk has k - 1."""

    quantity: str
    joint: str
    share: Array
    limit: float


def limits_used(robot: RobotModel, trajectory: JointTrajectory, torque: Array | None = None) -> Iterator[Used]:
    """Every finite limit of each joint: of positions, and of what the points give; `torque` (k, n) [N m or N]."""
    v, a = trajectory.velocities, trajectory.accelerations
    jerk = None
    if a is not None and len(a) > 1:
        jerk = np.diff(a, axis=0) / np.diff(trajectory.times)[:, None]
    for k, name in enumerate(trajectory.names):
        limits = robot.joint(name).limits
        lower, upper = limits.within_soft
        half = 0.5 * (upper - lower)
        if 0.0 < half < np.inf:
            yield Used("position", name, np.abs(trajectory.positions[:, k] - lower - half) / half, half)
        for quantity, values, limit in (
            ("velocity", v, limits.velocity),
            ("acceleration", a, limits.acceleration),
            ("jerk", jerk, limits.jerk),
            ("torque", torque, limits.effort),
        ):
            if values is not None and limit and np.isfinite(limit):
                yield Used(quantity, name, np.abs(values[:, k]) / limit, float(limit))


def nearest_limits(used: tuple[Used, ...], times: Array) -> tuple[Margin, ...]:
    """The joint that comes nearest to each kind of limit."""
    found: dict[str, Margin] = {}
    for each in used:
        k = int(np.argmax(each.share))
        share = float(each.share[k])
        if each.quantity not in found or share > found[each.quantity].used:
            found[each.quantity] = Margin(each.joint, each.quantity, share, (1.0 - share) * each.limit, float(times[k]))
    return tuple(found.values())


def _binding(used: tuple[Used, ...], margins: tuple[Margin, ...], slowed: bool) -> Binding | None:
    """Each point counts for the limit that is used most there, if it binds; `slowed`: a constraint does."""
    # `velocity_scaling` scales velocities and accelerations alike. A constraint may be what keeps the joints slow, too.
    most = max((one.used for one in margins if one.quantity in ("velocity", "acceleration")), default=1.0)
    scaled = 1.0 if slowed else most
    timed = [each for each in used if each.quantity != "position"]
    if not timed or scaled <= 0.0:
        return None
    shares = np.zeros((len(timed), max(len(each.share) for each in timed)))
    for k, each in enumerate(timed):
        shares[k, : len(each.share)] = each.share / (scaled if each.quantity in ("velocity", "acceleration") else 1.0)
    binds = shares.max(axis=0) >= BINDS
    if not binds.any():
        return None
    counts = np.bincount(np.argmax(shares, axis=0)[binds], minlength=len(timed))
    best = timed[int(np.argmax(counts))]
    return Binding(best.joint, best.quantity, float(counts.max()) / shares.shape[1])


def manipulability(
    planner: Planner, trajectory: JointTrajectory, begins: PlanningState, *, only_end: bool = False
) -> Manipulability | None:
    """The least along a motion that begins in this state, or at its end; None for a robot without a tool."""
    steps = max(1, round(trajectory.duration / EVERY))
    last = len(trajectory.times) - 1
    chosen = np.unique(np.linspace(last if only_end else 0, last, steps + 1).astype(int))
    q = with_joints(planner.robot, begins.position, trajectory.names, trajectory.positions[chosen])
    try:
        values = [planner.solver.least_singular_value(row) for row in with_mimics(planner.robot, q)]
    except NotPlannable:  # no tool
        return None
    k = int(np.argmin(values))
    return Manipulability(values[k], float(trajectory.times[chosen[k]]))
