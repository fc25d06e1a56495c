"""Time-optimal stops from any state of motion with Ruckig.

Ruckig (Berscheid and Kroeger, RSS 2021) keeps velocity, acceleration and jerk from any initial velocity and
acceleration. A state beyond a limit is first brought back within it, as fast as the next limit allows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import LONGEST

_STRAIGHT = 1e-6  # share of the acceleration limits


def stopped(
    names: Sequence[str],
    state: tuple[Array, Array, Array],
    *,
    acceleration: Array,
    jerk: Array,
    period: float,
    together: bool,
) -> JointTrajectory:
    """The quickest stop of `names` (n) from a state of motion: where they come to rest is open.

    Args:
        state: position, velocity and acceleration (n).
        acceleration, jerk: (n) limits; a jerk may be infinite.
        period: control period [s]; one point per tick, and the last at rest.
        together: the joints stop at the same time, on a straight line where velocity and acceleration are along it.

    Raises:
        NotPlannable: Ruckig finds none, or it takes longer than `LONGEST`.
    """
    import ruckig

    q, v, a = state
    along = _along(v, a, acceleration) if together else None
    if along is not None:  # Ruckig's own synchronisation leaves the line where another joint's limit is the tighter one
        speeds = np.abs(v[v != 0.0])
        one = (np.zeros(1), np.ones(1), np.array([along]))
        least = [np.min(limit[v != 0.0] / speeds, keepdims=True) for limit in (acceleration, jerk)]
        line = stopped(("s",), one, acceleration=least[0], jerk=least[1], period=period, together=False)
        assert line.velocities is not None and line.accelerations is not None
        return JointTrajectory.of_arrays(
            names, line.times, frozen(q + line.positions * v), frozen(line.velocities * v),
            frozen(line.accelerations * v),
        )  # fmt: skip
    problem = ruckig.InputParameter(len(names))
    problem.control_interface = ruckig.ControlInterface.Velocity
    problem.synchronization = ruckig.Synchronization.Time if together else ruckig.Synchronization.No
    problem.current_position, problem.current_velocity, problem.current_acceleration = (x.tolist() for x in state)
    problem.target_velocity = problem.target_acceleration = [0.0] * len(names)
    problem.max_acceleration, problem.max_jerk = acceleration.tolist(), jerk.tolist()
    profile = ruckig.Trajectory(len(names))
    try:
        result = ruckig.Ruckig(len(names)).calculate(problem, profile)
    except ruckig.RuckigError as refused:
        why = str(refused).strip().partition("\n")[0]
        raise NotPlannable(f"Ruckig found no motion from this state ({why})") from None
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise NotPlannable(f"Ruckig found no motion from this state ({result.name})")
    if profile.duration > LONGEST:
        raise NotPlannable(f"the motion takes more than {LONGEST:g} s")
    ticks = max(1, int(np.ceil(profile.duration / period - 1e-9)))
    times = np.arange(ticks + 1) * period
    positions, velocities, accelerations = np.array([profile.at_time(t) for t in times.tolist()]).transpose(1, 0, 2)
    velocities[-1] = accelerations[-1] = 0.0
    return JointTrajectory.of_arrays(names, frozen(times), frozen(positions), frozen(velocities), frozen(accelerations))


def _along(v: Array, a: Array, limit: Array) -> float | None:
    """k where a = k v within rounding; else None. `limit` (n) of the acceleration."""
    k = float(a @ v) / max(float(v @ v), 1e-12)
    return k if bool((np.abs(a - k * v) <= _STRAIGHT * limit).all()) and v.any() else None
