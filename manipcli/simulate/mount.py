"""Where a sensor is: the pose of its frame S in a link, a body or the world, and how it moves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from manipcli.core.geometry import Transform, matrix_from_quat
from manipcli.model.grasp import LINK
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.spec.mounted_sensor import MountedSpec

WORLD: Final = "world"
BASE: Final = "base"


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
    def kinematics(self) -> Kinematics:
        """Of the robot, for this sensor alone."""
        return Kinematics(self.robot)

    @cached_property
    def movable(self) -> int:
        """Index of the parent in body arrays; -1 for a link, a fixed body or the world."""
        if self.on_link or not self.parent or self.scene.body(self.parent).fixed:
            return -1
        return self.scene.movable.index(self.scene.body(self.parent))

    @property
    def part(self) -> str:
        """Name of the parent in contacts."""
        return f"{LINK}{self.parent}" if self.on_link else self.parent

    def pose(self, state: WorldState) -> Transform:
        """X_WS now."""
        if self.on_link:
            return self.kinematics.forward(state.position, self.parent) @ self.X_PS
        if not self.parent:
            return self.X_PS
        body = self.scene.body(self.parent)
        if body.fixed:
            return body.X_WO @ self.X_PS
        k = self.movable
        R = matrix_from_quat(state.body_quat_xyzw[k])
        return Transform(R=R, p=np.array(state.body_position[k])) @ self.X_PS


class LastTick:
    """Velocities one control tick ago, for accelerations; those of the first tick itself before the second.

    Attributes:
        velocity: (n) of the joints.
        body_linear, body_angular: (m, 3) of the bodies.
    """

    def __init__(self, state: WorldState) -> None:
        self.velocity = np.array(state.velocity)
        self.body_linear = np.array(state.body_linear)
        self.body_angular = np.array(state.body_angular)

    def keep(self, state: WorldState) -> None:
        """Copy the velocities of this tick for the next."""
        self.velocity[:] = state.velocity
        self.body_linear[:] = state.body_linear
        self.body_angular[:] = state.body_angular


def mount_of(spec: MountedSpec, robot: RobotModel, scene: Scene) -> Mount:
    """Where a sensor of a checked task is."""
    at = spec.at.transform
    if spec.link is not None:
        return Mount(robot, scene, spec.link, True, at)
    name = spec.frame or WORLD
    if (frame := scene.frame(name)) is not None:
        name, at = frame.parent, frame.X_PF @ at
    if name == BASE:
        name, at = WORLD, robot.X_WB @ at
    return Mount(robot, scene, "" if name == WORLD else name, False, at)
