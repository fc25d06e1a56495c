"""Joint vectors to look at: named poses, the zero pose, and mimic joints that follow."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, frozen
from manipcli.model.robot import JointLimits, RobotModel


def within(limits: JointLimits, value: float) -> float:
    """The nearest value inside the limits."""
    if limits.lower is not None:
        value = max(value, limits.lower)
    return min(value, limits.upper) if limits.upper is not None else value


def following(robot: RobotModel, q: npt.ArrayLike) -> Array:
    """(..., n) the same with every mimic joint where its leader puts it: multiplier * q_leader + offset."""
    position = np.array(q, dtype=np.float64)
    index = {name: k for k, name in enumerate(robot.joint_names)}
    for k, joint in enumerate(robot.moving_joints):
        if joint.mimic is not None:
            leader = position[..., index[joint.mimic.joint]]
            position[..., k] = joint.mimic.multiplier * leader + joint.mimic.offset
    return frozen(position)


def zero_posture(robot: RobotModel) -> Array:
    """(n,) every independent joint at zero, or at the limit nearest to it."""
    return following(robot, [within(joint.limits, 0.0) for joint in robot.moving_joints])


def posture(robot: RobotModel, pose: str | None = None, *, rest: Array | None = None) -> Array:
    """(n,) a named pose; None: `home` where there is one, else zero.

    Args:
        robot: the robot.
        pose: its name.
        rest: (n,) where the joints are that it does not speak of; at zero by default.
    """
    q = np.array(zero_posture(robot) if rest is None else rest)
    if pose is None:
        pose = next((known.name for known in robot.poses if known.name == "home"), None)
    if pose is not None:
        named = robot.pose(pose)
        q[robot.indices(named.joints)] = named.positions
    return following(robot, q)
