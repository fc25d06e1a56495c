"""Time-optimal motions from any state of motion with Ruckig: to rest, or to a goal at rest.

Ruckig (Berscheid and Kroeger, RSS 2021) keeps velocity, acceleration and jerk from any initial velocity and
acceleration. A state beyond a limit is first brought back within it, as fast as the next limit allows.
"""

from __future__ import annotations

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import LONGEST


def stopped(q: Array, v: Array, a: Array, limits: MotionLimits, *, period: float) -> JointTrajectory:
    """The quickest stop of each joint from position, velocity and acceleration (n): where they come to rest is open.

    Args:
        q, v, a: in the order of `limits.names`.
        limits: acceleration, and jerk where finite.
        period: control period [s]; one point per tick, and the last at rest.

    Raises:
        NotPlannable: Ruckig finds none, or it takes longer than `LONGEST`.
    """
    return _motion(q, v, a, None, limits, period)


def redirected(q: Array, v: Array, a: Array, goal: Array, limits: MotionLimits, *, period: float) -> JointTrajectory:
    """The quickest motion from a state of motion to rest at `goal` (n); all joints arrive together.

    Args:
        q, v, a: (n) in the order of `limits.names`.
        goal: (n) position.
        limits: velocity, acceleration, and jerk where finite. The path is not straight: check position limits and
            collisions.
        period: control period [s]; one point per tick, and the last at rest.

    Raises:
        NotPlannable: Ruckig finds none, or it takes longer than `LONGEST`.
    """
    return _motion(q, v, a, goal, limits, period)


def _motion(q: Array, v: Array, a: Array, goal: Array | None, limits: MotionLimits, period: float) -> JointTrajectory:
    import ruckig

    n = len(q)
    problem = ruckig.InputParameter(n)
    problem.current_position, problem.current_velocity = q.tolist(), v.tolist()
    problem.current_acceleration = a.tolist()
    problem.target_velocity = problem.target_acceleration = [0.0] * n
    problem.max_velocity = limits.velocity.tolist()
    problem.max_acceleration, problem.max_jerk = limits.acceleration.tolist(), limits.jerk.tolist()
    if goal is None:
        problem.control_interface = ruckig.ControlInterface.Velocity
        problem.synchronization = ruckig.Synchronization.No
    else:
        problem.target_position = goal.tolist()
    profile = ruckig.Trajectory(n)
    result = ruckig.Ruckig(n).calculate(problem, profile)
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise NotPlannable(f"Ruckig found no motion from this state ({result.name})")
    if profile.duration > LONGEST:
        raise NotPlannable(f"the motion takes more than {LONGEST:g} s")
    ticks = max(1, int(np.ceil(profile.duration / period - 1e-9)))
    times = np.arange(ticks + 1) * period
    positions, velocities, accelerations = np.array([profile.at_time(t) for t in times.tolist()]).transpose(1, 0, 2)
    velocities[-1] = accelerations[-1] = 0.0
    if goal is not None:
        positions[-1] = goal
    return JointTrajectory.of_arrays(
        limits.names, frozen(times), frozen(positions), frozen(velocities), frozen(accelerations)
    )
