"""Motions within the limits, torques and constraints of a step: straight in joint space, on a line, or a smooth curve.

Collisions are checked by the caller, except on the tool's line, which a constraint led away from the straight path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.core.work import TIMING
from manipcli.model.collision import CollisionQuery
from manipcli.model.configuration import with_joints
from manipcli.plan.keep import Kept, refuse_unkept, reserving
from manipcli.plan.kept_path import kept_paths
from manipcli.plan.limit_check import verify
from manipcli.plan.line import Walk, timed_line
from manipcli.plan.motion import PlanningState
from manipcli.plan.motion_constraints import applying, bounds_of, keeps_of
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.pose_error import Leaving
from manipcli.plan.retimer import retime
from manipcli.plan.sweep import refuse_collision, swept
from manipcli.plan.timing_bound import TimingBound, refuse_exceeded
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import backwards, stretched

_SOME = 50  # instants at which loads at rest are examined


def straight_motion(
    planner: Planner,
    state: PlanningState,
    label: str,
    limits: MotionLimits,
    end: Array,
    *,
    query: CollisionQuery,
    line: Transform | None,
    reserve: bool = True,
) -> JointTrajectory | None:
    """Straight in joint space to `end` (n); where that violates a constraint, on the tool's line; None if that does not
    do, either: a path is to be searched.

    Args:
        planner, state, label: what moves, from where, and the label of the motion.
        limits: of the joints that move.
        end: of all joints.
        query: for a path that is not straight.
        line: the tool pose at `end`, if the arm may arrive there in another configuration.
        reserve: whether the constraints are tighter by what is left to the run, whose tracking is not exact.

    Raises:
        NotPlannable: a motion that keeps the constraints exceeds a limit, or start or end violate a constraint.
    """
    keeps = applying(keeps_of(planner, state, label), end)
    if reserve:
        keeps = reserving(keeps, state.position, end)
    for points in kept_paths(planner, state, limits.names, end, keeps, line):
        try:
            trajectory = _smooth(planner, state, limits, points, keeps)
            if len(points) > 2:
                refuse_collision(planner, state, query, label, trajectory, None)
        except NotPlannable:
            if len(points) == 2:
                raise
        else:
            return trajectory
    return None


def tool_motion(
    planner: Planner,
    state: PlanningState,
    label: str,
    limits: MotionLimits,
    walk: Walk,
    *,
    insist: bool,
    leaving: Leaving,
) -> JointTrajectory:
    """Along a path of the tool that `walk` solves; see `timed_line`.

    Raises:
        NotPlannable: there is no such path, or its motion exceeds a limit or violates a constraint.
    """
    keeps = keeps_of(planner, state, label)

    def bounds(points: Array) -> Sequence[TimingBound]:
        planner.kinematics.work.add(TIMING)
        return bounds_of(planner, state, limits.names, points, keeps)

    solver = planner.solver.leaving(leaving)
    trajectory = timed_line(walk, solver, limits, period=planner.period, insist=insist, bounds=bounds)
    _refuse(planner, state, applying(keeps, _end(planner, state, trajectory)), trajectory)
    return trajectory


def smooth_motion(
    planner: Planner, state: PlanningState, label: str, limits: MotionLimits, points: Array
) -> JointTrajectory:
    """Along a smooth curve through `points` (k, m), the first of which is here.

    Raises:
        NotPlannable: it exceeds a limit or violates a constraint.
    """
    end = with_joints(planner.robot, state.position, limits.names, points[-1])
    return _smooth(planner, state, limits, points, applying(keeps_of(planner, state, label), end))


def reversed_motion(planner: Planner, state: PlanningState, label: str, motion: JointTrajectory) -> JointTrajectory:
    """The motion backwards; slower where that exceeds a bound, as friction acts in the other direction."""
    back = backwards(motion)
    some = back.positions[np.linspace(0, len(back.positions) - 1, _SOME).astype(int)]
    bounds = bounds_of(planner, state, back.names, some, keeps_of(planner, state, label))
    return stretched(back, bounds, planner.period)


def refuse_violation(planner: Planner, state: PlanningState, label: str, trajectory: JointTrajectory) -> None:
    """Check the constraints of a motion that is timed already.

    Raises:
        NotPlannable: names the constraint, the amount and the time.
    """
    keeps = applying(keeps_of(planner, state, label), _end(planner, state, trajectory))
    _refuse(planner, state, keeps, trajectory)


def _smooth(
    planner: Planner, state: PlanningState, limits: MotionLimits, points: Array, keeps: tuple[Kept, ...]
) -> JointTrajectory:
    planner.kinematics.work.add(TIMING)
    bounds = bounds_of(planner, state, limits.names, points, keeps)
    trajectory = retime(points, limits, period=planner.period, bounds=bounds)
    verify(trajectory, limits)
    _refuse(planner, state, keeps, trajectory)
    return trajectory


def _refuse(planner: Planner, state: PlanningState, keeps: tuple[Kept, ...], trajectory: JointTrajectory) -> None:
    """Check the constraints of a motion at every control tick."""
    if any(kept.margin is not None for kept in keeps):
        refuse_unkept(keeps, *swept(planner, state, trajectory, None))
    dynamics = PathDynamics(planner, state, trajectory.names)
    refuse_exceeded([kept.bound(dynamics) for kept in keeps if kept.bound is not None], trajectory)


def _end(planner: Planner, state: PlanningState, trajectory: JointTrajectory) -> Array:
    return with_joints(planner.robot, state.position, trajectory.names, trajectory.positions[-1])
