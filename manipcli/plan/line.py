"""A line of the tool with time: walked by the inverse kinematics, then timed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.limits import MotionLimits
from manipcli.plan.retimer import retime
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.verify import overshoot, verify

Walk = Callable[[InverseKinematics], Array]
"""The path (k, n) along a line, with the joints where this solver has them."""

_TRIES: Final = 3  # of 64 random lines along limits one mends 46, three 51


def timed_line(
    walk: Walk, solver: InverseKinematics, limits: MotionLimits, *, period: float, insist: bool
) -> JointTrajectory:
    """The fastest motion along what `walk` finds, at rest at both ends.

    Where a joint of a redundant arm comes to its limit, the others go on without it: a corner in its path, over which
    the smooth curve through the waypoints swings, beyond the limit. If it is to `insist`, the line is then walked again
    with that limit drawn in by twice as much, so that the tool stays on it; where there are other ways to try, one that
    keeps clear of the limits is quicker.

    Args:
        walk: finds the path.
        solver: of the joints that move.
        limits: of the same joints, in their order.
        period: control period [s].
        insist: see above.

    Raises:
        NotPlannable: there is no such path, or its motion leaves a limit.
    """
    trajectory = retime(walk(solver), limits, period=period)
    margin = np.zeros(len(limits.names))
    for _ in range(_TRIES if insist else 0):
        over = overshoot(trajectory, limits)
        if not over.any():
            break
        margin += 2.0 * over
        try:
            trajectory = retime(walk(solver.drawn_in(margin)), limits, period=period)
        except NotPlannable:  # the line needs that joint all the way: what is told is the limit that it leaves
            break
    verify(trajectory, limits)
    return trajectory
