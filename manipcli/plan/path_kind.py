"""What the path of a planned motion is, for reports: straight, a line of the tool, a curve, or searched."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.batch_motion import frames
from manipcli.plan.held_frame import held_points
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.sweep import swept

_JOINTS: Final = 1e-6  # rad or m off the straight line: rounding
_TOOL: Final = 1e-3  # m: joint motions between the points of a line leave it by less
_SAMPLES: Final = 50


def path_kind(planner: Planner, motion: Motion, begins: PlanningState) -> str:
    """`straight` (in joint space), `tool line`, `curve`, or `searched, PLANNER`; "" without a path.

    Args:
        planner: of the task.
        motion: planned.
        begins: the state before it.
    """
    trajectory = motion.trajectory
    if trajectory is None:
        return ""
    if motion.searched:
        return f"searched, {motion.searched}"
    if _off_line(trajectory.positions) < _JOINTS:
        return "straight"
    _, positions = swept(planner, begins, trajectory, None)
    some = positions[np.linspace(0, len(positions) - 1, _SAMPLES).astype(int)]
    try:
        _, link, X_LT, _ = held_points(planner, begins)
    except NotPlannable:  # without a tool
        return "curve"
    points, _ = frames(planner.robot, some, link, X_LT)
    return "tool line" if _off_line(points) < _TOOL < np.linalg.norm(points[-1] - points[0]) else "curve"


def _off_line(points: Array) -> float:
    """The largest distance of points (k, n) from the line from the first to the last."""
    offset, chord = points - points[0], points[-1] - points[0]
    square = max(float(chord @ chord), 1e-18)
    return float(np.linalg.norm(offset - np.outer(offset @ chord / square, chord), axis=1).max())
