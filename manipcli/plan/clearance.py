"""Least clearance of planned motions: the nearest pair of parts that must not touch, and when."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.clearance import least_distance
from manipcli.model.collision import RESOLUTION, CollisionHit
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.sweep import swept


def least_clearance(planner: Planner, motion: Motion, end: PlanningState) -> CollisionHit | None:
    """The nearest pair of parts in a motion that may not touch, with its distance [m] and time [s].

    The motion is examined at configurations of which no joint is further apart than `RESOLUTION`, as in planning.
    None for a motion in which nothing moves.

    Args:
        planner: of the task.
        motion: planned.
        end: the state after it.
    """
    state = motion.begins
    if state is None or (motion.trajectory is None and motion.grip is None):
        return None
    times, positions = _configurations(planner, motion, state, end)
    found = least_distance(planner.query(state, motion.allowed), positions)
    if found is None:
        return None
    k, hit = found
    return CollisionHit(hit.a, hit.b, hit.distance, time=float(times[k]))


def _configurations(planner: Planner, motion: Motion, state: PlanningState, end: PlanningState) -> tuple[Array, Array]:
    """Times (k,) [s] and positions (k, n) of all joints; a hand that closes ends where it is predicted to stop."""
    if motion.grip is not None and motion.grip.force is not None:
        times = np.linspace(0.0, motion.duration, 20)
        share = np.linspace(0.0, 1.0, 20)[:, None]
        return times, state.position + share * (end.position - state.position)
    times, positions = swept(planner, state, motion.trajectory, motion.grip)
    steps = np.max(np.abs(np.diff(positions, axis=0)), axis=1)
    walked = np.concatenate(([0.0], np.cumsum(steps)))
    chosen = np.unique(np.searchsorted(walked, np.append(np.arange(0.0, walked[-1], RESOLUTION), walked[-1])))
    return times[chosen], positions[chosen]
