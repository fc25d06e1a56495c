"""Velocity and acceleration of a frame at many instants at once in numpy, by recursion from the base to its link.

For a revolute joint with the axis z through its frame's origin, between the link before (w', alpha') and its child:

    w = w' + z v,    alpha = alpha' + z a + w' x z v,    v_p = v_p' + w' x r,    a_p = a_p' + alpha' x r + w' x (w' x r)

with r between the origins; a prismatic joint adds z v to v_p and z a + 2 w' x z v to a_p.
Source: Featherstone, Rigid Body Dynamics Algorithms (2008), section 3.3 in ordinary vectors.
"""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform, cross, quat_product, rotate
from manipcli.model.batch_kinematics import forward_batch, joints_above, link_places
from manipcli.model.robot import RobotModel


def frames(robot: RobotModel, q: Array, link: str, X_LF: Transform) -> tuple[Array, Array]:
    """Positions (k, 3) [m] and unit quaternions (k, 4) xyzw in the world of a frame F in a link, at (k, n)."""
    last, X = link_places(robot)[link]
    X = X @ X_LF
    if last < 0:
        return np.tile(X.p, (len(q), 1)), np.tile(X.quat_xyzw, (len(q), 1))
    p, quat = forward_batch(robot, q)
    return p[:, last] + rotate(quat[:, last], X.p), quat_product(quat[:, last], X.quat_xyzw)


def point_motion(
    robot: RobotModel, q: Array, v: Array, a: Array, link: str, X_LF: Transform
) -> tuple[Array, Array, Array]:
    """Quaternion (k, 4), velocity (k, 3) [m/s] and acceleration (k, 3) [m/s2] of a frame F in a link, in the world.

    Args:
        robot: the robot.
        q, v, a: (k, n) positions of all joints and their derivatives.
        link, X_LF: the link, and the frame in it.
    """
    last, X = link_places(robot)[link]
    X = X @ X_LF
    p, quat = forward_batch(robot, q)
    w, alpha, velocity, acceleration = np.zeros((4, len(q), 3))
    before = None
    for k in joints_above(robot, last):
        joint = robot.moving_joints[k]
        if before is not None:
            velocity, acceleration = _moved(p[:, k] - p[:, before], w, alpha, velocity, acceleration)
        z = rotate(quat[:, k], np.array(joint.axis))
        rate = z * v[:, k, None]
        if joint.type == "prismatic":
            velocity = velocity + rate
            acceleration = acceleration + z * a[:, k, None] + 2.0 * cross(w, rate)
        else:
            alpha = alpha + z * a[:, k, None] + cross(w, rate)
            w = w + rate
        before = k
    if before is None:
        return np.tile(X.quat_xyzw, (len(q), 1)), velocity, acceleration
    arm = rotate(quat[:, last], X.p)
    velocity, acceleration = _moved(arm, w, alpha, velocity, acceleration)
    return quat_product(quat[:, last], X.quat_xyzw), velocity, acceleration


def _moved(r: Array, w: Array, alpha: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
    """Of another point of the same body, at r (k, 3) from this one."""
    turning = cross(w, r)
    return velocity + turning, acceleration + cross(alpha, r) + cross(w, turning)
