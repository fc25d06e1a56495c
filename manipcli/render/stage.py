"""What sensors of light see of a robot and a scene: surfaces with colours, and their poses in a sensor's frame."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_quat
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.render.drawing import WORLD, draw, link_frame
from manipcli.scene.scene import Scene

DEVIATION = 1e-4
"""Most by which the chords of spheres and cylinders lie within them [m]."""


class Stage:
    """The visual surfaces of a robot and a scene, and where they are.

    Attributes:
        surfaces: (s) each in the frame of its part.
        colours: (s, 3) 0 to 1.
        parts: names of the parts, `robot/<link>` or a body; index 0 is `world`, which has no surfaces.
        part_of: (s) index of the part of each surface.
        missing: what cannot be drawn, one line each.
    """

    def __init__(self, robot: RobotModel, scene: Scene) -> None:
        drawing = draw(robot, scene, deviation=DEVIATION)
        shown = [each for each in drawing.layer("visual") if each.rgba[3] > 0.0 and len(each.surface.faces)]
        self.parts = drawing.frames
        self.missing = drawing.missing
        index = {name: k for k, name in enumerate(self.parts)}
        self.surfaces = tuple(each.surface for each in shown)
        self.colours = np.array([each.rgba[:3] for each in shown]).reshape(-1, 3)
        self.part_of = np.array([index[each.frame] for each in shown], dtype=np.int64)
        self._kinematics = Kinematics(robot)
        self._links = np.array([index[link_frame(link.name)] for link in robot.links], dtype=np.int64)
        self._movable = np.array([index[body.name] for body in scene.movable], dtype=np.int64)
        self._R, self._p = np.tile(np.eye(3), (len(self.parts), 1, 1)), np.zeros((len(self.parts), 3))
        for body in scene.bodies:
            self._R[index[body.name]], self._p[index[body.name]] = body.X_WO.R, body.X_WO.p
        assert self.parts[0] == WORLD

    def poses(self, state: WorldState, X_WS: Transform) -> tuple[Array, Array]:
        """Where the surfaces are, from a sensor at X_WS: rotations (s, 3, 3) and positions (s, 3) [m], new arrays."""
        R, p = self._R, self._p
        R[self._links], p[self._links] = self._kinematics.link_poses(state.position)
        if len(self._movable):
            R[self._movable], p[self._movable] = matrix_from_quat(state.body_quat_xyzw), state.body_position
        turned = X_WS.R.T
        return (turned @ R)[self.part_of], ((p - X_WS.p) @ X_WS.R)[self.part_of]


_last: tuple[RobotModel, Scene, Stage] | None = None


def stage_of(robot: RobotModel, scene: Scene) -> Stage:
    """The stage of these objects; the last one is kept, so that all sensors of a run share it."""
    global _last
    if _last is None or _last[0] is not robot or _last[1] is not scene:
        _last = (robot, scene, Stage(robot, scene))
    return _last[2]
