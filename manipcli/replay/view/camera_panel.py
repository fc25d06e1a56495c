"""Buttons that move the camera of a browser: named views, focus on a part, projection."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.render.drawing import WORLD, Drawing
from manipcli.render.placing import Poses
from manipcli.replay.camera import FIELD, FROM, VIEWS, Vector, framing

if TYPE_CHECKING:
    import viser

EVERYTHING, TOOL = "everything", "tool frame"
NEAREST: Final = 0.05
"""[m] Smallest radius of what the camera is moved to; of the tool frame and of frames without surfaces."""
NARROW: Final = 1.0
"""[deg] Vertical field of view that stands for a parallel projection."""
STEEP: Final = 1e-3
"""Tangent by which the view from above is off the vertical, so that x is up."""


class CameraPanel:
    """Views and focus.

    Args:
        server: the viser server.
        drawing: what is shown.
        floors: frames of the floors, which are not framed.
        poses: gives the poses that are shown now.
        tool: gives the place (3,) [m] of the tool in the world; None without a tool.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        drawing: Drawing,
        floors: frozenset[str],
        poses: Callable[[], Poses],
        tool: Callable[[], Array] | None,
    ) -> None:
        self._server, self._drawing, self._floors = server, drawing, floors
        self._poses, self._tool = poses, tool
        self._frames: dict[str, str] = {}
        for frame in drawing.frames:
            short = frame.removeprefix("robot/")
            if frame != WORLD and frame not in floors:
                taken = short in self._frames or short in (EVERYTHING, TOOL)
                self._frames[frame if taken else short] = frame
        gui = server.gui
        for row in (tuple(VIEWS)[:3], tuple(VIEWS)[3:]):
            group = gui.add_button_group("view" if row[0] == "iso" else " ", row)
            group.on_click(lambda event: self._view(event, event.target.value))
        options = (EVERYTHING, *((TOOL,) if tool is not None else ()), *self._frames)
        focus = gui.add_dropdown("focus", options, initial_value=EVERYTHING, hint="Move the camera to a part.")
        focus.on_update(lambda event: self._focus(event, focus.value))
        self._parallel = gui.add_checkbox("parallel", False, hint="Nearly no perspective, to compare lengths.")
        self._parallel.on_update(self._project)

    def _clients(self, event: viser.GuiEvent[Any]) -> Iterable[viser.ClientHandle]:
        return (event.client,) if event.client is not None else self._server.get_clients().values()

    @property
    def field(self) -> float:
        """Vertical field of view [deg]."""
        return NARROW if self._parallel.value else FIELD

    def _view(self, event: viser.GuiEvent[Any], name: str) -> None:
        for client in self._clients(event):
            self.view(client, name)

    def view(self, client: viser.ClientHandle, name: str) -> None:
        """Move the camera of a browser to a view by name, with everything in it."""
        self._look(client, *self.framed(VIEWS[name], client.camera.aspect))

    def framed(self, towards: Vector, aspect: float) -> tuple[Array, Array]:
        """(3,), (3,) [m] eye and target from which everything is in view, seen from a direction.

        Args:
            towards: from the scene to the camera.
            aspect: width over height of the picture.
        """
        if towards[:2] == (0.0, 0.0):
            towards = (-STEEP, 0.0, towards[2])
        camera = framing(
            self._drawing, self._poses(), aspect=max(aspect, 0.3), leave_out=self._floors, towards=towards
        ).further(1.1)
        eye, target = np.array(camera.eye), np.array(camera.target)
        return target + (eye - target) * _further(self.field), target

    def ball(self, name: str) -> tuple[Array, float]:
        """Centre (3,) and radius [m] of a part in the world."""
        if name == TOOL and self._tool is not None:
            return self._tool(), 2.0 * NEAREST
        poses, frame = self._poses(), self._frames[name]
        X = poses.X_WF(self._drawing.frames.index(frame))
        own = [d.surface.vertices for d in self._drawing.drawables if d.frame == frame and len(d.surface.vertices)]
        if not own:
            return np.asarray(X.p), NEAREST
        points = X.apply(np.concatenate(own))
        centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
        return centre, max(NEAREST, float(np.linalg.norm(points - centre, axis=1).max()))

    def _focus(self, event: viser.GuiEvent[Any], name: str) -> None:
        for client in self._clients(event):
            if name == EVERYTHING:
                self._look(client, *self.framed(FROM, client.camera.aspect))
                continue
            centre, radius = self.ball(name)
            back = client.camera.position - client.camera.look_at
            back = back / max(1e-9, float(np.linalg.norm(back)))
            distance = 1.5 * radius / math.sin(math.radians(self.field) / 2.0)
            self._look(client, centre + distance * back, centre)

    def _project(self, event: viser.GuiEvent[Any]) -> None:
        for client in self._clients(event):
            camera = client.camera
            before = _further(math.degrees(camera.fov))
            target, back = camera.look_at, camera.position - camera.look_at
            with client.atomic():
                camera.fov = math.radians(self.field)
                self._look(client, target + back * _further(self.field) / before, target)

    def _look(self, client: viser.ClientHandle, eye: Array, target: Array) -> None:
        with client.atomic():
            client.camera.up_direction = (0.0, 0.0, 1.0)
            client.camera.position = eye
            client.camera.look_at = target


def _further(field: float) -> float:
    """How many times farther away a camera of this field of view [deg] sees what one of `FIELD` sees."""
    return math.tan(math.radians(FIELD) / 2.0) / math.tan(math.radians(field) / 2.0)
