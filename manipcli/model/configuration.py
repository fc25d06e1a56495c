"""Configurations: positions of all joints, from named poses or zero, with mimic joints resolved."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, frozen
from manipcli.description.elements import Joint
from manipcli.model.robot import RobotModel


def position_limits(joints: Iterable[Joint]) -> tuple[Array, Array]:
    """(n,) lower and (n,) upper position limits [rad or m], inside active soft limits; infinite if unlimited."""
    ranges = [joint.limits.within_soft for joint in joints]
    return frozen([lower for lower, _ in ranges]), frozen([upper for _, upper in ranges])


def with_mimics(robot: RobotModel, q: npt.ArrayLike, *, rates: bool = False) -> Array:
    """(..., n) `q` with every mimic joint at multiplier * q_leader + offset; of `rates`, without the offset.

    A joint that a closed loop moves follows its curve; its rates are those of the curve's chord.
    """
    position = np.array(q, dtype=np.float64)
    for k, joint in enumerate(robot.moving_joints):
        if joint.mimic is not None:
            leader = position[..., robot.joint_names.index(joint.mimic.joint)]
            position[..., k] = joint.mimic.multiplier * leader + 0.0 if rates else joint.mimic.follow(leader)
    return frozen(position)


def leads(robot: RobotModel, names: Sequence[str]) -> bool:
    """Whether another joint mimics one of these."""
    return any(joint.mimic is not None and joint.mimic.joint in names for joint in robot.moving_joints)


def with_joints(
    robot: RobotModel, rest: Array, names: Sequence[str], values: npt.ArrayLike, *, rates: bool = False
) -> Array:
    """(..., n) the positions `rest` (n) of all joints, with those of some joints at `values` (..., m).

    Joints that mimic these follow. The same of `rates`: velocities or accelerations.
    """
    values = np.asarray(values, dtype=np.float64)
    position = np.tile(rest, (*values.shape[:-1], 1))
    position[..., robot.indices(tuple(names))] = values
    return with_mimics(robot, position, rates=rates) if leads(robot, names) else position


def zero_configuration(robot: RobotModel) -> Array:
    """(n,) every independent joint at zero, or at its limit nearest to zero."""
    return with_mimics(robot, [joint.limits.nearest(0.0) for joint in robot.moving_joints])


def configuration(robot: RobotModel, pose: str | None = None, *, rest: Array | None = None) -> Array:
    """(n,) a named pose; by default `home` if it exists, else zero.

    Args:
        robot: the robot.
        pose: name of the pose.
        rest: (n,) positions of the joints that the pose does not set; zero by default.
    """
    q = np.array(zero_configuration(robot) if rest is None else rest)
    if pose is None:
        pose = "home" if any(known.name == "home" for known in robot.poses) else None
    if pose is not None:
        named = robot.pose(pose)
        q[robot.indices(named.joints)] = named.positions
    return with_mimics(robot, q)


def named_configurations(robot: RobotModel, start: Array) -> Array:
    """(T, n): the start, and every named pose with the other joints as at the start."""
    return np.array([start, *(configuration(robot, pose.name, rest=start) for pose in robot.poses)])
