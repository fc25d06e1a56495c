"""Time-optimal motion on a straight line in joint space, from rest to rest, with bounded jerk where a limit is set.

All joints move in phase: q(t) = q0 + s(t) (q1 - q0), so the path is straight and all joints arrive together. The
coordinate s in [0, 1] is bounded by the tightest joint: |s'| <= min_i v_i / |q1_i - q0_i|, and likewise for
acceleration and jerk; Ruckig (Berscheid and Kroeger, RSS 2021) solves that one-dimensional problem exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.timing_bound import TimingBound
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import on_ticks, refuse_endless


def rest_to_rest(
    start: npt.ArrayLike,
    goal: npt.ArrayLike,
    limits: MotionLimits,
    *,
    period: float,
    bounds: Sequence[TimingBound] = (),
) -> JointTrajectory:
    """The fastest straight move from `start` to `goal` (n) within `limits`, one point per control tick.

    Args:
        start, goal: (n) in the order of `limits.names`, rad or m.
        limits: velocity, acceleration, and jerk where finite.
        period: control period [s].
        bounds: kept by stretching time.

    Raises:
        NotPlannable: the limits make it too long, or a position is not finite.
    """
    import ruckig

    q0 = np.asarray(start, dtype=np.float64)
    q1 = np.asarray(goal, dtype=np.float64)
    if not (np.isfinite(q0).all() and np.isfinite(q1).all()):
        raise NotPlannable("a start or goal joint position is not finite")
    delta = q1 - q0
    moving = np.abs(delta) > 1e-12
    if not moving.any():
        return on_ticks(lambda t: _line(q0, delta, np.zeros((len(t), 3))), 0.0, target=q1, limits=limits, period=period)

    def bound(limit: Array) -> float:
        return float(np.min(limit[moving] / np.abs(delta[moving])))

    refuse_endless(np.stack((q0, q1)), limits)  # Ruckig cannot time what takes hours
    problem = ruckig.InputParameter(1)
    problem.current_position, problem.target_position = [0.0], [1.0]
    problem.max_velocity = [bound(limits.velocity)]
    problem.max_acceleration = [bound(limits.acceleration)]
    problem.max_jerk = [bound(limits.jerk)]
    profile = ruckig.Trajectory(1)
    result = ruckig.Ruckig(1).calculate(problem, profile)
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise NotPlannable(f"Ruckig found no rest-to-rest motion ({result.name})")

    def curve(times: Array) -> tuple[Array, Array, Array]:
        return _line(q0, delta, np.array([profile.at_time(t) for t in times.tolist()]).reshape(-1, 3))

    return on_ticks(curve, profile.duration, target=q1, limits=limits, period=period, bounds=bounds)


def _line(q0: Array, delta: Array, s: Array) -> tuple[Array, Array, Array]:
    """Positions, velocities, accelerations (k, n) on the line, from s and its two derivatives (k, 3)."""
    return q0 + s[:, :1] * delta, s[:, 1:2] * delta, s[:, 2:] * delta
