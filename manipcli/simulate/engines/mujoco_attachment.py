"""Attachment of bodies to the tool of MuJoCo's robot: a weld for each movable body, inactive until it is attached."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np

from manipcli.core.geometry import Array, Transform, quat_from_matrix
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.simulate.engines.mujoco_shapes import wxyz


def add_welds(mujoco: ModuleType, spec: Any, link: str, bodies: Sequence[str], **solver: Any) -> None:
    """Add an inactive weld of each body to the link of the tool, by the names of their `MjsBody`."""
    for name in bodies:
        weld = spec.add_equality(
            type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=link, name2=name, active=False,
            **solver,
        )  # fmt: skip
        weld.data[:] = 0.0
        weld.data[6] = weld.data[10] = 1.0  # an identity quaternion; weight of rotations


class Attachments:
    """Attached bodies of one world, by the welds of `add_welds`, which are its last equality constraints.

    Args:
        mujoco, model, data: the library and the world.
        robot, scene: of the world.
        links: MuJoCo's number of the body of each link.
    """

    def __init__(
        self, mujoco: ModuleType, model: Any, data: Any, robot: RobotModel, scene: Scene, links: dict[str, int]
    ) -> None:
        self._mujoco, self._model, self._data = mujoco, model, data
        names = [body.name for body in scene.movable] if robot.holding is not None else []
        self._welds = {name: model.neq - len(names) + k for k, name in enumerate(names)}
        self._moved = {joint.child for joint in scene.joints}
        self._attached: dict[str, Array] = {}
        if robot.tool is not None:
            self._link, self._X_LT = links[robot.tool.link], robot.tool.X_LT

    def __bool__(self) -> bool:
        return bool(self._attached)

    def attach(self, name: str) -> Array:
        """Fix a body to the tool; see `Engine.attach`."""
        model, weld = self._model, self._welds[name]
        self._mujoco.mj_kinematics(model, self._data)  # a step leaves the poses of its start
        X_WL, X_WO = self._pose(self._link), self._pose(model.eq_obj2id[weld])
        X_LO = X_WL.inverse() @ X_WO
        model.eq_data[weld, :3] = (X_LO.inverse() @ self._X_LT).p  # the weld is at the tool frame
        model.eq_data[weld, 3:6] = X_LO.apply(model.eq_data[weld, :3])
        model.eq_data[weld, 6:10] = wxyz(quat_from_matrix(X_LO.R))
        self._data.eq_active[weld] = 1
        self._attached[name] = np.zeros(6)
        return self._attached[name]

    def detach(self, name: str) -> None:
        """Free the body."""
        self._data.eq_active[self._welds[name]] = 0
        del self._attached[name]

    def measure(self) -> None:
        """Compute the wrenches of the last physics step."""
        mujoco, model, data = self._mujoco, self._model, self._data
        count = data.nefc
        equality = data.efc_type[:count] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        X_WT = self._pose(self._link) @ self._X_LT
        for name, wrench in self._attached.items():
            weld = self._welds[name]
            body = model.eq_obj2id[weld]
            force = np.where(equality & (data.efc_id[:count] == weld), data.efc_force[:count], 0.0)
            R_WO = data.xmat[body].reshape(3, 3)
            if name in self._moved:
                # Rows of a weld, on the tool: forces in the world at the tool, halves of torques along the axes of O.
                rows = np.zeros(6)  # before the first step there are none
                mine = force[equality & (data.efc_id[:count] == weld)]
                rows[: len(mine)] = mine
                f, t = -rows[:3], -0.5 * R_WO @ rows[3:]
            else:
                generalised = np.zeros(model.nv)
                mujoco.mj_mulJacTVec(model, data, generalised, force)
                at = model.body_dofadr[body]
                # Of a free joint: the force along the axes of the world, the torque about its centre along those of O.
                f = generalised[at : at + 3]
                t = R_WO @ generalised[at + 3 : at + 6] + np.cross(data.xpos[body] - X_WT.p, f)
            wrench[:3], wrench[3:] = X_WT.R.T @ f, X_WT.R.T @ t

    def _pose(self, body: int) -> Transform:
        x, y, z, w = np.roll(self._data.xquat[body], -1)
        return Transform.of(xyz=self._data.xpos[body], quat_xyzw=(x, y, z, w))
