"""Centres of mass in the browser: of each link and movable body, and of the whole robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from manipcli.core.geometry import Array, rotate
from manipcli.core.text import digits
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import link_frame
from manipcli.render.placing import Poses
from manipcli.replay.view.viser_scene import ViserScene
from manipcli.scene.scene import Scene

if TYPE_CHECKING:
    import viser

RADIUS: Final = 0.012
"""[m] Radius of the ball of 1 kg; the volume is proportional to the mass."""
COLOUR: Final = (51, 115, 230)
WHOLE: Final = (224, 49, 49)


class Masses:
    """Balls at the centres of mass, hidden at first.

    Args:
        server: the viser server.
        scene: the shown scene.
        robot, bodies: whose masses are shown.
    """

    def __init__(self, server: viser.ViserServer, scene: ViserScene, robot: RobotModel, bodies: Scene | None) -> None:
        self._columns: list[int] = []
        index = {frame: k for k, frame in enumerate(scene.paths)}
        found: list[tuple[str, float, Array]] = []
        for link in robot.links:
            if link.inertial is not None and link.inertial.mass > 0.0:
                found.append((link_frame(link.name), link.inertial.mass, link.inertial.X_LI.p))
        self._columns = [index[frame] for frame, *_ in found]
        self._masses = np.array([mass for _, mass, _ in found])
        self._places = np.array([place for *_, place in found]).reshape(-1, 3)
        for body in () if bodies is None else bodies.movable:
            found.append((body.name, body.mass, body.X_OI.p))
        self._nodes: list[viser.IcosphereHandle | viser.LabelHandle] = []
        for k, (frame, mass, place) in enumerate(found):
            path, radius = f"{scene.paths[frame]}/mass_{k}", RADIUS * float(np.cbrt(mass))
            self._ball(server, path, radius, COLOUR, f"{digits(mass)} kg", place)
        self._whole = None
        if len(self._masses):
            total = float(self._masses.sum())
            text = f"robot: {digits(total)} kg"
            self._whole = self._ball(
                server, "/centre_of_mass", RADIUS * float(np.cbrt(total)), WHOLE, text, np.zeros(3)
            )

    def _ball(
        self, server: viser.ViserServer, path: str, radius: float, colour: tuple[int, int, int], text: str, place: Array
    ) -> viser.IcosphereHandle:
        ball = server.scene.add_icosphere(path, radius=radius, color=colour, position=place, visible=False)
        label = server.scene.add_label(f"{path}/kg", text, visible=False, font_screen_scale=0.75, anchor="bottom-left")
        self._nodes += [ball, label]
        return ball

    def centre(self, poses: Poses) -> Array:
        """(3,) [m] the centre of mass of the robot in the world."""
        places = poses.position[self._columns] + rotate(poses.quat_xyzw[self._columns], self._places)
        return np.asarray(self._masses @ places / self._masses.sum())

    def place(self, poses: Poses) -> None:
        """Move the centre of mass of the robot."""
        if self._whole is not None:
            self._whole.position = self.centre(poses)

    def show(self, shown: bool) -> None:
        """Show or hide the balls and their masses."""
        for node in self._nodes:
            node.visible = shown
