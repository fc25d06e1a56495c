"""The motion of a search: the tool slides on a spiral and back to where it began, within the limits of the joints."""

from __future__ import annotations

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.planner import Planner
from manipcli.plan.spiral import spiral
from manipcli.plan.trajectory import JointTrajectory


def search_motion(
    builder: MotionBuilder, planner: Planner, X_WT: Transform, R: Array, pitch: float, radius: float
) -> None:
    """Add the motion of the tool from `X_WT`, where it is, on a spiral in the plane x, y of `R` (3, 3).

    Args:
        builder: of the step.
        planner: of the step.
        X_WT: pose of the tool in the middle.
        R: axes in the world.
        pitch: [m] between two turns.
        radius: [m] of the spiral.

    Raises:
        NotPlannable: the arm cannot follow it.
    """
    times, points = spiral(pitch, radius)
    solver, q = planner.solver, np.array(builder.now.position)
    columns, found = list(solver.columns), []
    for x, y in points:
        solution = solver.near(Transform.of(xyz=R @ [x, y, 0.0]) @ X_WT, q)
        if not (solution.converged or solution.within(solver.tolerance)):
            raise NotPlannable(
                f"the search reaches no further than {1000.0 * float(np.hypot(x, y)):.1f} mm: "
                f"{solution.explain(solver.tolerance)}",
                hint="make `search` smaller, or move the hole nearer",
            )
        q = solution.q
        found.append(q[columns])
    path = np.array(found)
    path[0] = builder.now.position[columns]
    limits = MotionLimits.of(planner.robot, solver.joints, velocity_scale=1.0, acceleration_scale=1.0)
    curve = JointTrajectory.of_arrays(solver.joints, times, path).with_spline_velocities()
    builder.follow("search", curve, limits=limits)
