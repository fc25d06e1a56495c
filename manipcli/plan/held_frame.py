"""The held object or the tool along many configurations at once."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_quat, quat_product, rotate
from manipcli.model.batch_kinematics import forward_batch, link_places
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner


def frames(robot: RobotModel, q: Array, link: str, X_LF: Transform) -> tuple[Array, Array]:
    """Positions (k, 3) [m] and rotations (k, 3, 3) in the world of a frame F in a link, at positions q (k, n)."""
    last, X = link_places(robot)[link]
    X = X @ X_LF
    if last < 0:
        return np.tile(X.p, (len(q), 1)), np.tile(X.R, (len(q), 1, 1))
    p, quat = forward_batch(robot, q)
    R = [matrix_from_quat(each) for each in quat_product(quat[:, last], X.quat_xyzw)]
    return p[:, last] + rotate(quat[:, last], X.p), np.array(R)


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
    p, R = frames(planner.robot, q, link, X_LO)
    return np.asarray(p[:, None] + np.einsum("kij,mj->kmi", R, corners))
