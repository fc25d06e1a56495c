"""Where a sensor is: the pose of its frame S in a link, a body or the world, and how it moves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_quat
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene


@dataclass(frozen=True)
class Mount:
    """A sensor frame S at `X_PS` in `parent`: a link of the robot, a body of the scene, or the world ("").

    Attributes:
        robot, scene: the true ones.
        parent: name of the link or body.
        on_link: whether the parent is a link.
        X_PS: pose of S in it.
    """

    robot: RobotModel
    scene: Scene
    parent: str
    on_link: bool
    X_PS: Transform

    @cached_property
    def _kinematics(self) -> Kinematics:
        return Kinematics(self.robot)

    def pose(self, state: WorldState) -> Transform:
        """X_WS now."""
        if self.on_link:
            return self._kinematics.forward(state.position, self.parent) @ self.X_PS
        if not self.parent:
            return self.X_PS
        body = self.scene.body(self.parent)
        if body.fixed:
            return body.X_WO @ self.X_PS
        k = self.scene.movable.index(body)
        R = matrix_from_quat(state.body_quat_xyzw[k])
        return Transform(R=R, p=np.array(state.body_position[k])) @ self.X_PS
