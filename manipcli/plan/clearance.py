"""Least clearance of planned motions: the nearest pair of parts that must not touch, and when."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.clearance import least_distance
from manipcli.model.collision import RESOLUTION, CollisionHit, Pair
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.planner import ROBOT, Planner
from manipcli.plan.sweep import swept


def least_clearance(
    planner: Planner, motion: Motion, end: PlanningState, of: Callable[[Pair], bool] = lambda _: True
) -> CollisionHit | None:
    """The nearest pair of parts in a motion that may not touch, with its distance [m] and time [s].

    The motion is examined at configurations of which no joint is further apart than `RESOLUTION`, as in planning.
    None for a motion in which nothing moves.

    Args:
        planner: of the task.
        motion: planned.
        end: the state after it.
        of: the pairs that are examined.
    """
    state = motion.begins
    if state is None or (motion.trajectory is None and motion.grip is None):
        return None
    times, positions = _configurations(planner, motion, state, end)
    found = least_distance(planner.query(state, motion.allowed), positions, of)
    if found is None:
        return None
    k, hit = found
    return CollisionHit(hit.a, hit.b, hit.distance, time=float(times[k]))


@dataclass(frozen=True, slots=True)
class StatedClearance:
    """A clearance that the task states for a pair of parts, and what the plan keeps of it.

    Attributes:
        between: the pair; `robot` for all links.
        stated: [m].
        nearest: in all motions; None where the pair is never checked: it may touch, or does not move.
        motion: index of the motion of `nearest`.
    """

    between: tuple[str, str]
    stated: float
    nearest: CollisionHit | None = None
    motion: int = 0


def stated_clearances(
    planner: Planner, spans: Sequence[tuple[Motion, PlanningState, PlanningState]]
) -> tuple[StatedClearance, ...]:
    """What the motions of a plan, each with the states before and after it, keep of each clearance of `planner`."""
    groups: dict[tuple[str, str, float], set[frozenset[str]]] = {}
    for pair, distance in planner.clearances.items():
        a, b = sorted("robot" if name.startswith(ROBOT) else name for name in pair)
        groups.setdefault((a, b, distance), set()).add(pair)
    found = []
    for (a, b, distance), pairs in groups.items():
        hits = [
            (k, hit)
            for k, (motion, _, end) in enumerate(spans)
            if (hit := least_clearance(planner, motion, end, lambda pair: frozenset(pair) in pairs)) is not None  # noqa: B023
        ]
        k, nearest = min(hits, key=lambda each: each[1].distance, default=(0, None))
        found.append(StatedClearance((a, b), distance, nearest, k))
    return tuple(found)


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
