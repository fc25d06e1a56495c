"""Carrying: the tool with what it holds goes straight to a pose, or around obstacles."""

from __future__ import annotations

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Transform
from manipcli.plan.free_motion import line_blocked
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner


def carry(planner: Planner, builder: MotionBuilder, label: str, X_WT: Transform, *, speed: float) -> None:
    """Move the tool, with what it holds, on a straight line to a pose; where that is not free, around obstacles.

    What has contents stays upright there, too, see `motion_constraints`.

    Raises:
        NotPlannable: neither has a plan.
    """
    held = builder.now.carried is not None
    search = planner.searching(obstructed=False) if held else None
    if search is None or line_blocked(planner, builder.now, X_WT, builder.query()) is None:
        try:
            return _straight(planner, builder, label, X_WT, speed)
        except NotPlannable:
            if not held or planner.searching() is None:
                raise
    try:
        builder.reach(label, X_WT, speed=speed)
    except NotPlannable as other:
        if other.reason == "in_the_way":
            raise
        builder.straight(label, X_WT, speed=speed)  # for its refusal


def _straight(planner: Planner, builder: MotionBuilder, label: str, X_WT: Transform, speed: float) -> None:
    """On a straight line; an arm of few joints may have other yaws on it than those between the two poses.

    It must have the yaw of the goal at its end.
    """
    try:
        builder.straight(label, X_WT, speed=speed)
    except NotPlannable as refusal:
        if not planner.solver.few or refusal.reason != "line":
            raise
        other = builder.copy()
        other.straight(label, X_WT, speed=speed, leaving="yaw")
        if not planner.solver.reaches(X_WT, other.now.position):
            raise
        builder.adopt(other)
