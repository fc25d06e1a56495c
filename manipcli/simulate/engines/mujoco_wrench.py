"""Wrenches at joints of MuJoCo's robot, from its recursive Newton-Euler algorithm with all contact forces."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np

from manipcli.core.geometry import Array, cross


class WrenchSensors:
    """All sensors of one robot.

    Args:
        mujoco, model, data: the library and the world.
        links: MuJoCo's number of the body of each link.
        step: [s] of the physics.
    """

    def __init__(self, mujoco: ModuleType, model: Any, data: Any, links: Mapping[str, int], step: float) -> None:
        self._mujoco, self._model, self._data = mujoco, model, data
        self._links, self._step = links, step
        self._sensors: list[tuple[int, Array]] = []
        self._before = np.zeros(model.nv)
        self._fresh = False

    def __bool__(self) -> bool:
        return bool(self._sensors)

    def add(self, link: str) -> Array:
        """A sensor between `link` and its parent.

        Returns:
            (6) force [N] and torque [N m] of the link on its parent, in the link's frame, about its origin.
        """
        values = np.zeros(6)
        self._sensors.append((self._links[link], values))
        return values

    def remember(self) -> None:
        """Store the velocities before the last physics step of a tick."""
        self._before[:] = self._data.qvel
        self._fresh = True

    def measure(self) -> None:
        """Compute the wrenches of the last physics step.

        The accelerations are those of the step, (v' - v) / h: with implicit damping and exact mimic joints they differ
        from those of the solver.
        """
        if not self._fresh:
            return
        self._fresh = False
        data = self._data
        data.qacc[:] = (data.qvel - self._before) / self._step
        self._mujoco.mj_rnePostConstraint(self._model, data)
        for body, values in self._sensors:
            wrench = -data.cfrc_int[body]  # MuJoCo's acts on the child: torque, force
            R = data.xmat[body].reshape(3, 3)
            arm = data.subtree_com[self._model.body_rootid[body]] - data.xpos[body]
            values[:3] = R.T @ wrench[3:]
            values[3:] = R.T @ (wrench[:3] + cross(arm, wrench[3:]))
