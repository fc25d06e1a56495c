"""States of a planned motion over time: joints with their derivatives and torques, and the bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_mimics
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.prediction import carried_along
from manipcli.plan.sweep import swept


@dataclass(frozen=True, slots=True, eq=False)
class PlannedStates:
    """States of one motion, for the joints in the order of `RobotModel.moving_joints`.

    Attributes:
        times: (T,) [s] from the start of the motion, at least one.
        position, velocity, acceleration: (T, n); derivatives are 0 for joints that the trajectory does not move.
        torque: (T, n) [N m or N] by inverse dynamics, with friction and what is carried.
        bodies: for each time `X_WO` of every movable body.
    """

    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    bodies: tuple[tuple[Transform, ...], ...]


def planned_states(
    planner: Planner, motion: Motion, end: PlanningState, *, begins: PlanningState, period: float = 0.02
) -> PlannedStates:
    """States of a motion every `period` [s], and at its end.

    Args:
        planner: of the task.
        motion: planned.
        end: the state after it.
        begins: the state before it.
        period: between two states [s].
    """
    times = np.append(np.arange(0.0, motion.duration - 0.5 * period, period), motion.duration)
    if motion.trajectory is None and motion.grip is None:
        position = np.tile(begins.position, (len(times), 1))
    elif motion.grip is not None and motion.grip.force is not None:
        share = times[:, None] / max(motion.duration, 1e-9)
        position = begins.position + share * (end.position - begins.position)
    else:
        at, rows = swept(planner, begins, motion.trajectory, motion.grip)
        position = np.stack([np.interp(times, at, column) for column in rows.T], axis=1)
    velocity, acceleration = np.zeros_like(position), np.zeros_like(position)
    if motion.trajectory is not None:
        trajectory = motion.trajectory
        columns = list(planner.robot.indices(trajectory.names))
        rows_at = np.clip(times, trajectory.times[0], trajectory.times[-1])
        q, v, a = trajectory.sample(rows_at)
        moving = (times <= trajectory.times[-1])[:, None]
        position[:, columns] = q
        position = np.asarray(with_mimics(planner.robot, position))
        velocity[:, columns] = np.where(moving, v, 0.0)
        acceleration[:, columns] = np.where(moving, a, 0.0)
    bodies = [_bodies(planner, begins, row) for row in position]
    if motion.grip is not None or motion.trajectory is not None:
        bodies[-1] = end.bodies
    torque = PathDynamics(planner, begins, planner.robot.joint_names).efforts(position, velocity, acceleration)
    return PlannedStates(times, position, velocity, acceleration, torque, tuple(bodies))


def _bodies(planner: Planner, begins: PlanningState, q: Array) -> tuple[Transform, ...]:
    return carried_along(planner, begins, begins.moved(q)).bodies
