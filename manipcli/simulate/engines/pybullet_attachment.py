"""Attachment of a body to the tool of PyBullet's robot: a fixed constraint that exists while it is attached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.simulate.engines.pybullet_joints import Place

MOST: Final = 1e6
"""[N or N m] Largest effort of the constraint: what breaks it is decided by the session."""


class Pull(NamedTuple):
    """Force [N] and torque [N m] on Bullet's link `link` of the robot at `point`; (3,) each, in the world."""

    link: int
    point: Array
    force: Array
    torque: Array


class _Attached(NamedTuple):
    constraint: int
    body: int
    wrench: Array


class Attachments:
    """Attached bodies of one world.

    Args:
        p, client: PyBullet and its world.
        robot, number: the robot, and Bullet's number of its body.
        links: Bullet's numbers of its links.
        places: Bullet's numbers of each body of the scene.
    """

    def __init__(
        self, p: ModuleType, client: int, robot: RobotModel, number: int, links: Mapping[str, int],
        places: Mapping[str, Place],
    ) -> None:  # fmt: skip
        self._p, self._client, self._number, self._places = p, client, number, places
        self._attached: dict[str, _Attached] = {}
        tool = robot.tool
        if tool is not None:
            self._link = links[tool.link]
            info = p.getDynamicsInfo(number, self._link, physicsClientId=client)
            # Bullet's frame of a link is that of its inertia.
            self._X_IT = Transform.of(xyz=info[3], quat_xyzw=info[4]).inverse() @ tool.X_LT

    def __bool__(self) -> bool:
        return bool(self._attached)

    def attach(self, name: str) -> Array:
        """Fix a body to the tool; see `Engine.attach`."""
        p, (body, link) = self._p, self._places[name]
        X_OT = self._pose(body, link).inverse() @ self._tool()
        constraint = p.createConstraint(
            self._number, self._link, body, link, p.JOINT_FIXED, [0, 0, 0],
            parentFramePosition=self._X_IT.p.tolist(), parentFrameOrientation=self._X_IT.quat_xyzw.tolist(),
            childFramePosition=X_OT.p.tolist(), childFrameOrientation=X_OT.quat_xyzw.tolist(),
            physicsClientId=self._client,
        )  # fmt: skip
        p.changeConstraint(constraint, maxForce=MOST, physicsClientId=self._client)
        self._attached[name] = _Attached(constraint, body, np.zeros(6))
        return self._attached[name].wrench

    def detach(self, name: str) -> None:
        """Free the body."""
        self._p.removeConstraint(self._attached.pop(name).constraint, physicsClientId=self._client)

    def measure(self) -> list[Pull]:
        """Read the wrenches of the last physics step; returns what they exert on the robot."""
        pulls = []
        X_WT = self._tool()
        for attached in self._attached.values():
            # On the robot: force along the axes of the world, torque along those of the constraint, which are T's.
            state = self._p.getConstraintState(attached.constraint, physicsClientId=self._client)
            force, torque = np.array(state[:3]), np.array(state[3:6])
            attached.wrench[:3] = -(X_WT.R.T @ force)
            attached.wrench[3:] = -torque
            pulls.append(Pull(self._link, np.asarray(X_WT.p), force, X_WT.R @ torque))
        return pulls

    def _tool(self) -> Transform:
        """X_WT."""
        return self._pose(self._number, self._link) @ self._X_IT

    def _pose(self, body: int, link: int) -> Transform:
        """Bullet's frame of a link, or of a base (-1), in the world."""
        p = self._p
        if link < 0:
            at: Sequence[float]
            at, quat = p.getBasePositionAndOrientation(body, physicsClientId=self._client)
        else:
            at, quat = p.getLinkState(body, link, computeForwardKinematics=1, physicsClientId=self._client)[:2]
        return Transform.of(xyz=at, quat_xyzw=quat)
