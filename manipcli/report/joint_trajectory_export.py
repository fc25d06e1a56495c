"""A planned step as a trajectory_msgs/JointTrajectory in YAML, which a `follow` step reads back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.trajectory import CUBIC, QUINTIC, JointTrajectory
from manipcli.spec.resolved import number_text, yaml_word

TOLERANCE: Final = 1e-6
"""[rad or m] Deviation in position of the written splines."""
JERK: Final = 0.001
"""Deviation of the change of acceleration from point to point, as a share of the largest: `follow` verifies jerks."""
Span = tuple[Motion, PlanningState, PlanningState]
"""A motion with the states before and after it."""


@dataclass(frozen=True, slots=True)
class _Rows:
    times: list[float]
    position: list[Array]
    velocity: list[Array]
    acceleration: list[Array]

    def add(self, time: float, q: Array, v: Array, a: Array) -> None:
        """A point at the time of the one before it is the same point."""
        if self.times and time - self.times[-1] < 1e-9:
            return
        self.times.append(time)
        self.position.append(q)
        self.velocity.append(v)
        self.acceleration.append(a)


def step_trajectory(spans: Sequence[Span], columns: dict[str, int]) -> JointTrajectory | None:
    """The trajectories of all motions of a step as one, at rest while only the hand moves; None if the arm rests.

    Args:
        spans: motions of the step.
        columns: of each joint in `PlanningState.position`.
    """
    moved = {name for motion, _, _ in spans if motion.trajectory is not None for name in motion.trajectory.names}
    names = tuple(name for name in columns if name in moved)
    if not names:
        return None
    chosen, still = [columns[name] for name in names], np.zeros(len(names))
    rows, begins = _Rows([], [], [], []), 0.0
    for motion, before, _ in spans:
        here = before.position[chosen]
        rows.add(begins, here, still, still)
        if motion.trajectory is not None:
            _add(rows, begins, motion.trajectory, names, here)
            here = rows.position[-1]
        begins += motion.duration
        rows.add(begins, here, still, still)
    return thinned(
        JointTrajectory.of_arrays(
            names, np.array(rows.times), np.array(rows.position), np.array(rows.velocity), np.array(rows.acceleration)
        )
    )


def thinned(trajectory: JointTrajectory, *, tolerance: float = TOLERANCE, jerk: float = JERK) -> JointTrajectory:
    """Fewer points of a trajectory, whose curves of the same order differ from it by at most `tolerance`.

    Intervals are halved as long as they differ, or the changes of acceleration by a share `jerk` of the largest. A
    trajectory whose points give different values is returned as it is.
    """
    if trajectory.orders is not None:
        return trajectory
    times, positions = trajectory.times, trajectory.positions
    velocities, accelerations = trajectory.velocities, trajectory.accelerations
    kept = np.array([0, len(times) - 1])
    steps = None if accelerations is None else np.diff(accelerations, axis=0)
    steepest = 0.0 if steps is None else max(float(np.max(np.abs(steps))), 1e-9)
    while True:
        shorter = JointTrajectory.of_arrays(
            trajectory.names, times[kept], positions[kept], None if velocities is None else velocities[kept],
            None if accelerations is None else accelerations[kept],
        )  # fmt: skip
        p, _, a = shorter.sample(times)
        off = np.max(np.abs(p - positions), axis=1)[1:] > tolerance
        if steps is not None:
            off |= np.max(np.abs(np.diff(a, axis=0) - steps), axis=1) > jerk * steepest
        wrong = np.unique(np.searchsorted(kept, np.flatnonzero(off), side="right") - 1)
        middles = (kept[wrong] + kept[wrong + 1]) // 2
        more = np.setdiff1d(middles, kept)
        if not len(more):
            return shorter
        kept = np.union1d(kept, more)


def _add(rows: _Rows, begins: float, trajectory: JointTrajectory, names: Sequence[str], here: Array) -> None:
    at = [names.index(name) for name in trajectory.names]
    still = np.zeros(len(trajectory.names))
    for k, time in enumerate(trajectory.times.tolist()):
        q, v, a = np.array(here), np.zeros(len(names)), np.zeros(len(names))
        q[at] = trajectory.positions[k]
        v[at] = still if trajectory.velocities is None else trajectory.velocities[k]
        a[at] = still if trajectory.accelerations is None else trajectory.accelerations[k]
        rows.add(begins + time, q, v, a)


def message(trajectory: JointTrajectory, comment: str) -> str:
    """The message in YAML; numbers read back bit for bit, times to the nanosecond."""
    return "\n".join([f"# {comment}", *message_lines(trajectory)]) + "\n"


def message_lines(trajectory: JointTrajectory) -> list[str]:
    """The lines of the message; a point has the velocities and accelerations that it gives."""
    names = ", ".join(yaml_word(name) for name in trajectory.names)
    lines = ["header: {frame_id: ''}", f"joint_names: [{names}]", "points:"]
    orders = trajectory.order_of_points
    for k, time in enumerate(trajectory.times.tolist()):
        given = {"positions": trajectory.positions}
        if orders[k] >= CUBIC and trajectory.velocities is not None:
            given["velocities"] = trajectory.velocities
        if orders[k] >= QUINTIC and trajectory.accelerations is not None:
            given["accelerations"] = trajectory.accelerations
        values = ", ".join(f"{key}: {_list(rows[k])}" for key, rows in given.items())
        lines.append(f"- {{{values}, time_from_start: {duration_text(time)}}}")
    return lines


def duration_text(seconds: float) -> str:
    """builtin_interfaces/Duration in YAML, to the nanosecond."""
    sec, nanosec = divmod(round(seconds * 1e9), 1_000_000_000)
    return f"{{sec: {sec}, nanosec: {nanosec}}}"


def _list(values: Array) -> str:
    """In brackets; never '-0.0'."""
    return f"[{', '.join(number_text(float(value) + 0.0) for value in values)}]"
