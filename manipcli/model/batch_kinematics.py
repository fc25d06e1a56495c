"""Forward kinematics of many instants at once in numpy, for recordings and pictures.

Two constant quaternions describe each moving joint: with X_PJ = (p, v) and u = v (axis, 0), the quaternion of its child
link at angle q is u sin(q/2) + v cos(q/2).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen, quat_product, rotate
from manipcli.description.elements import Joint
from manipcli.model.robot import RobotModel


def relative_batch(robot: RobotModel, q: Array) -> tuple[Array, Array]:
    """Pose of each moving joint's child link in its parent link.

    Args:
        robot: the robot.
        q: (T, n) joint positions.

    Returns:
        Positions (T, n, 3) [m] and unit quaternions (T, n, 4) xyzw.
    """
    terms = _terms(robot)
    return terms.poses(q, *terms.parent)


def forward_batch(robot: RobotModel, q: Array) -> tuple[Array, Array]:
    """Pose of each moving joint's child link in the world.

    Args:
        robot: the robot.
        q: (T, n) joint positions.

    Returns:
        Positions (T, n, 3) [m] and unit quaternions (T, n, 4) xyzw.
    """
    terms = _terms(robot)
    p, quat = terms.poses(q, *terms.last)
    for k, before in enumerate(terms.before):
        if before >= 0:
            p[:, k] = p[:, before] + rotate(quat[:, before], p[:, k])
            quat[:, k] = quat_product(quat[:, before], quat[:, k])
    return p, quat


def tool_poses(robot: RobotModel, q: Array) -> tuple[Array, Array]:
    """Pose of the robot's tool in the world at joint positions (T, n): (T, 3) [m] and (T, 4) xyzw."""
    assert robot.tool is not None
    last, X = link_places(robot)[robot.tool.link]
    X = X @ robot.tool.X_LT
    if last < 0:
        return np.tile(X.p, (len(q), 1)), np.tile(X.quat_xyzw, (len(q), 1))
    p, quat = forward_batch(robot, q)
    return p[:, last] + rotate(quat[:, last], X.p), quat_product(quat[:, last], X.quat_xyzw)


def link_places(robot: RobotModel) -> Mapping[str, tuple[int, Transform]]:
    """(index, X) of each link: its constant pose in the child link of moving joint `index`, or in the world (-1)."""
    return _terms(robot).places


def still_links(robot: RobotModel) -> frozenset[str]:
    """Names of the links that no joint moves: the root and all links fixed to it."""
    return frozenset(name for name, (joint, _) in link_places(robot).items() if joint < 0)


def joints_above(robot: RobotModel, last: int) -> tuple[int, ...]:
    """Indices of the moving joints from the base to moving joint `last`, included; -1 is the world."""
    before, chain = _terms(robot).before, []
    while last >= 0:
        chain.append(last)
        last = before[last]
    return tuple(reversed(chain))


class _Terms:
    """The constants of a robot's moving joints, relative to the parent link and to the moving joint `before`."""

    def __init__(self, robot: RobotModel) -> None:
        joints = robot.moving_joints
        self._turning = np.array([joint.type != "prismatic" for joint in joints], dtype=bool)
        self._sliding = np.flatnonzero(~self._turning)
        self.parent = _halves(joints, [joint.X_PJ for joint in joints])
        self.places: dict[str, tuple[int, Transform]] = {robot.root: (-1, robot.X_WB)}
        placements: list[Transform] = []
        before: list[int] = []
        for joint in robot.joints:
            last, X = self.places[joint.parent]
            X = X @ joint.X_PJ
            if joint.moves:
                placements.append(X)
                before.append(last)
                last, X = len(before) - 1, Transform.identity()
            self.places[joint.child] = (last, X)
        self.before = tuple(before)
        self.last = _halves(joints, placements)

    def poses(self, q: Array, p0: Array, u: Array, v: Array, slide: Array) -> tuple[Array, Array]:
        half = np.where(self._turning, q, 0.0) * 0.5
        quat = np.sin(half)[..., None] * u + np.cos(half)[..., None] * v
        p = np.repeat(p0[None], len(q), axis=0)
        if len(self._sliding):
            p[:, self._sliding] += q[:, self._sliding, None] * slide[self._sliding]
        return p, quat


def _halves(joints: tuple[Joint, ...], placements: list[Transform]) -> tuple[Array, Array, Array, Array]:
    """(p, u, v, slide), each (n, 3 or 4): position, the two quaternions, and the sliding direction in the parent."""
    n = len(joints)
    p, u, v, slide = np.zeros((n, 3)), np.zeros((n, 4)), np.zeros((n, 4)), np.zeros((n, 3))
    for k, (joint, X) in enumerate(zip(joints, placements, strict=True)):
        p[k], v[k] = X.p, X.quat_xyzw
        u[k] = quat_product(v[k], np.array([*joint.axis, 0.0]))
        slide[k] = X.R @ joint.axis
    return frozen(p), frozen(u), frozen(v), frozen(slide)


@lru_cache(maxsize=8)
def _terms(robot: RobotModel) -> _Terms:
    return _Terms(robot)
