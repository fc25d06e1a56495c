"""Motion of the tool, or of a held object, and torques of the joints along a path of some joints."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.batch_motion import point_motion
from manipcli.model.configuration import with_joints
from manipcli.model.kinematics import Kinematics
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner


class PathDynamics:
    """The robot in a planning state, with what it holds, while some joints (n) move.

    Attributes:
        columns: (n) of these joints in a vector of all joints.
    """

    def __init__(self, planner: Planner, state: PlanningState, names: tuple[str, ...]) -> None:
        self.columns = planner.robot.indices(names)
        self._names = names
        self._rest = np.array(state.position)
        self._robot = planner.robot
        self._loaded = _loaded(planner, state)
        joints = [planner.robot.joint(name) for name in names]
        self._coulomb = np.array([joint.friction for joint in joints])
        self._damping = np.array([joint.damping for joint in joints])

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """(k, n) M a + C v + g of these joints, with the rotors' inertia and what is held, at (k, n) each [N m or N].

        Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 5.
        """
        inverse, columns = self._loaded.inverse_dynamics, self.columns
        whole = zip(self._whole(q), *(self._padded(each) for each in (v, a)), strict=True)
        return np.array([inverse(*instant)[columns] for instant in whole]).reshape(q.shape)

    def efforts(self, q: Array, v: Array, a: Array) -> Array:
        """(k, n) the torques with the friction of the joints: what their motors need [N m or N]."""
        return np.asarray(self.torques(q, v, a) + self._coulomb * np.sign(v) + self._damping * v)

    def points(self, q: Array, v: Array, a: Array, link: str, X_LT: Transform) -> tuple[Array, Array, Array]:
        """(quaternion (k, 4), velocity (k, 3) [m/s], acceleration (k, 3) [m/s2]) of a frame T in a link."""
        return point_motion(self._robot, self._whole(q), self._padded(v), self._padded(a), link, X_LT)

    def _whole(self, q: Array) -> Array:
        return with_joints(self._robot, self._rest, self._names, q)

    def _padded(self, rates: Array) -> Array:
        return with_joints(self._robot, np.zeros_like(self._rest), self._names, rates, rates=True)


def _loaded(planner: Planner, state: PlanningState) -> Kinematics:
    """The robot's dynamics with the held body and its contents."""
    carried = state.carried
    if carried is None:
        return planner.kinematics
    X_OW = planner.body_pose(state, carried.body).inverse()
    loads = []
    for name in (carried.body, *planner.contents(state, carried.body)):
        body = planner.scene.body(name)
        X_LO = carried.X_LO @ X_OW @ planner.body_pose(state, name)
        loads.append((body.mass, X_LO @ body.X_OI, body.inertia))
    return planner.kinematics.carrying(carried.link, loads)
