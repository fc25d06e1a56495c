"""Timed straight line of the tool: inverse kinematics along the line, then retiming."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.limit_check import overshoot, verify
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.retimer import retime
from manipcli.plan.timing_bound import TimingBound
from manipcli.plan.trajectory import JointTrajectory

Walk = Callable[[InverseKinematics], Array]
"""The joint path (k, n) along a line, as this solver finds it."""

_TRIES: Final = 3  # one attempt repairs 46 of 64 random lines along limits, three repair 51


def timed_line(
    walk: Walk,
    solver: InverseKinematics,
    limits: MotionLimits,
    *,
    period: float,
    insist: bool,
    bounds: Callable[[Array], Sequence[TimingBound]] = lambda _: (),
) -> JointTrajectory:
    """The fastest motion along what `walk` finds, at rest at both ends.

    Where a joint of a redundant arm reaches its limit, the other joints continue without it. The joint's path then has
    a corner, and the smooth curve through the waypoints overshoots the limit. With `insist`, the line is solved once
    more with that limit narrowed by twice the overshoot, so that the tool stays on the line. Where other candidates
    exist, trying one that keeps clear of the limits is quicker.

    Args:
        walk: finds the path.
        solver: of the joints that move.
        limits: of the same joints, in their order.
        period: control period [s].
        insist: see above.
        bounds: on the timing of a joint path (k, n).

    Raises:
        NotPlannable: there is no such path, or its motion exceeds a limit.
    """

    def timed(solver: InverseKinematics) -> JointTrajectory:
        points = walk(solver)
        return retime(points, limits, period=period, bounds=bounds(points))

    trajectory = timed(solver)
    margin = np.zeros(len(limits.names))
    for _ in range(_TRIES if insist else 0):
        over = overshoot(trajectory, limits)
        if not over.any():
            break
        margin += 2.0 * over
        try:
            trajectory = timed(solver.drawn_in(margin))
        except NotPlannable:  # the line needs that joint throughout: `verify` reports the limit that it exceeds
            break
    verify(trajectory, limits)
    return trajectory
