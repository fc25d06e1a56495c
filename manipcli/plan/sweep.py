"""Simultaneous motion of arm and hand: positions of all joints over time, its duration, and its collisions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.collision import RESOLUTION, CollisionHit, CollisionQuery
from manipcli.model.configuration import leads, with_mimics
from manipcli.model.edge_check import EdgeCheck
from manipcli.plan.hand import ramp
from manipcli.plan.motion import Grip, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import LONGEST


def grip_time(planner: Planner, state: PlanningState, grip: Grip) -> float:
    """Time that the hand's references take to the target [s].

    Raises:
        NotPlannable: longer than `LONGEST`.
    """
    here, speed = state.position[planner.robot.indices(grip.joints)], planner.gripper_speed
    duration = float(np.max(np.abs(grip.target - here))) / speed
    if duration > LONGEST:
        unit = planner.robot.joint(grip.joints[0]).unit
        message = f"the hand takes more than {LONGEST:g} s at its controller's speed of {speed:g} {unit}/s"
        raise NotPlannable(message, hint="raise `speed` of the gripper controller")
    return duration


def swept(
    planner: Planner, state: PlanningState, trajectory: JointTrajectory | None, grip: Grip | None
) -> tuple[Array, Array]:
    """Times (k,) [s] and positions (k, n) of all moving joints while arm and hand move together."""
    robot = planner.robot
    times = np.zeros(1) if trajectory is None else trajectory.times
    if grip is not None:
        speed, late = planner.gripper_speed, grip_time(planner, state, grip) - times[-1]
        more = int(np.ceil(max(0.0, late) * speed / (0.5 * RESOLUTION)))
        times = np.append(times, times[-1] + late * np.arange(1, more + 1) / max(1, more))
    positions = np.tile(state.position, (len(times), 1))
    if trajectory is not None:
        columns = robot.indices(trajectory.names)
        positions[:, columns] = trajectory.positions[-1]
        positions[: len(trajectory.times), columns] = trajectory.positions
        if leads(robot, trajectory.names):
            positions = np.array(with_mimics(robot, positions))
    if grip is not None:
        columns = robot.indices(grip.joints)
        positions[:, columns] = ramp(state.position[columns], grip.target, speed * times)
        positions = np.asarray(with_mimics(robot, positions))
    return times, positions


def refuse_collision(
    planner: Planner,
    state: PlanningState,
    query: CollisionQuery,
    label: str,
    trajectory: JointTrajectory | None,
    grip: Grip | None,
    *,
    move: bool = False,
) -> None:
    """Check this motion, which begins in `state`, for collisions with the `query`.

    Raises:
        NotPlannable: names the pair, and the time in the motion of this `label`.
    """
    hit = first_hit(planner, state, query, trajectory, grip)
    if hit is not None:
        raise blocked(planner, state, hit, label, move=move)


def first_hit(
    planner: Planner,
    state: PlanningState,
    query: CollisionQuery,
    trajectory: JointTrajectory | None,
    grip: Grip | None,
    *,
    slack: float | None = None,
) -> CollisionHit | None:
    """The first collision of this motion with the `query`, at points a fixed step apart.

    Where they are free and the query permits no overlap, the bound of the motion between them is checked, too
    (`EdgeCheck`, with this `slack`).
    """
    times, positions = swept(planner, state, trajectory, grip)
    hit = query.check_trajectory(range(positions.shape[1]), state.position, times, positions)
    if hit is not None or query.margin < 0.0 or len(positions) < 2:
        return hit
    check = EdgeCheck(query, slack=slack)
    where = check.free_polyline(positions)
    if where is None:
        return None
    assert check.blocked is not None
    near = query.check(check.blocked)
    assert near is not None
    return replace(near, time=float(times[where]))


def blocked(
    planner: Planner, state: PlanningState, hit: CollisionHit, label: str, *, move: bool = False
) -> NotPlannable:
    """The refusal of the motion of this `label`, which begins in `state`, for a collision."""
    return planner.refusal(state, hit, "comes", f"at t = {hit.time:.2f} s of '{label}'", move=move)
