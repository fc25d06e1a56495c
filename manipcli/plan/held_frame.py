"""The held object or the tool along many configurations at once."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform, rotate
from manipcli.model.batch_motion import frames
from manipcli.model.collision import Carried
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner


def tilts(planner: Planner, carried: Carried, q: Array) -> Array:
    """(k) [rad] of the held object's z axis to the vertical, at positions q (k, n)."""
    _, quat = frames(planner.robot, q, carried.link, carried.X_LO)
    z = rotate(quat, np.array([0.0, 0.0, 1.0]))
    return np.asarray(np.arctan2(np.hypot(z[:, 0], z[:, 1]), z[:, 2]))


def held_points(planner: Planner, state: PlanningState) -> tuple[str, str, Transform, Array]:
    """(name, link, X_LO, corners (m, 3) in O): the held object's bounding box, or the tool's origin if nothing is held.

    The name is "'cup'" or "the tool".
    """
    carried, tool = state.carried, planner.robot.tool
    if carried is None:
        X_LT = Transform.identity() if tool is None else tool.X_LT
        return "the tool", planner.tool_link, X_LT, np.zeros((1, 3))
    body = planner.scene.body(carried.body)
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    return f"'{body.name}'", carried.link, carried.X_LO, body.centre + signs * body.size


def points_of(planner: Planner, state: PlanningState, q: Array) -> Array:
    """(k, m, 3) [m] those corners in the world at positions q (k, n)."""
    _, link, X_LO, corners = held_points(planner, state)
    p, quat = frames(planner.robot, q, link, X_LO)
    return np.asarray(p[:, None] + rotate(quat[:, None], corners))
