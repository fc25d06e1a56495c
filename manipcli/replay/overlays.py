"""What a replay shows over robot and scene: where the robot should be, the way of its tool, the forces of contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.drawing import Drawing, link_frame
from manipcli.replay.forces import Forces
from manipcli.replay.placing import Poses

if TYPE_CHECKING:
    import viser

GHOST = (40, 115, 240)
GHOST_OPACITY = 0.35
OFF, OFF_ANGLE = 0.002, 0.01
"""[m], [rad] by which a link is elsewhere than it should be."""
PATH = (237, 107, 13)
PATH_POINTS = 300
"""Of the way of the tool: it is sent again while the run plays."""
FORCE = (219, 26, 51)
THICKNESS = 0.003
"""[m] radius of the shaft of an arrow."""


class Ghost:
    """The links of a robot once more, clear and blue, those that are off; hidden at first.

    Two surfaces in one place would flicker, so a link that is where it should be has no ghost.

    Args:
        server: where.
        drawing: its robot is shown.
        links: names of the robot's links.
    """

    def __init__(self, server: viser.ViserServer, drawing: Drawing, links: tuple[str, ...]) -> None:
        self._frames = [drawing.frames.index(link_frame(link)) for link in links]
        self._root = server.scene.add_frame("/ghost", show_axes=False, visible=False)
        names = [link_frame(link) for link in links]
        self._nodes = [server.scene.add_frame(f"/ghost/{k}", show_axes=False) for k in range(len(names))]
        for n, one in enumerate(drawing.layer("visual")):
            if one.frame in names:
                server.scene.add_mesh_simple(
                    f"/ghost/{names.index(one.frame)}/{n}",
                    one.surface.vertices.astype(np.float32),
                    one.surface.faces.astype(np.uint32),
                    color=GHOST,
                    opacity=GHOST_OPACITY,
                    cast_shadow=False,
                    receive_shadow=False,
                )

    @property
    def visible(self) -> bool:
        """Whether it is shown; `place` is needed only then."""
        return self._root.visible

    @visible.setter
    def visible(self, shown: bool) -> None:
        self._root.visible = shown

    def place(self, wanted: Poses, measured: Poses) -> None:
        """Move it to where the robot should be at one instant, and is not."""
        for node, k in zip(self._nodes, self._frames, strict=True):
            p, q = wanted.position[k], wanted.quat_xyzw[k]
            turned = 2.0 * float(np.arccos(min(abs(float(q @ measured.quat_xyzw[k])), 1.0)))
            off = bool(np.linalg.norm(p - measured.position[k]) > OFF or turned > OFF_ANGLE)
            if off:
                node.position, node.wxyz = p, np.roll(q, 1)
            if node.visible != off:
                node.visible = off


class ToolPath:
    """The way of the tool as a line, and what of it is done as a thicker one.

    Args:
        server: where.
        points: (T, 3) [m].
    """

    def __init__(self, server: viser.ViserServer, points: Array) -> None:
        self._kept = np.unique(np.linspace(0, len(points) - 1, min(len(points), PATH_POINTS)).round().astype(int))
        self._points = points
        whole = _segments(points[self._kept])
        self._whole = server.scene.add_line_segments(
            "/path/whole", whole, colors=PATH, thickness=1.5, thickness_units="screen"
        )
        self._done = server.scene.add_line_segments(
            "/path/done", whole[:1], colors=PATH, thickness=4.0, thickness_units="screen"
        )

    def show(self, shown: bool) -> None:
        """Show or hide both lines."""
        self._whole.visible = self._done.visible = shown

    def place(self, k: int) -> None:
        """Time number k is reached."""
        before = self._kept[: int(np.searchsorted(self._kept, k, side="right"))]
        segments = _segments(self._points[np.append(before, k)])
        self._done.colors = np.broadcast_to(np.array(PATH, dtype=np.uint8), segments.shape).copy()
        self._done.points = segments


def _segments(points: Array) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """(N, 2, 3) from each point to the next; at least one."""
    if len(points) < 2:
        points = np.repeat(points[:1], 2, axis=0)
    return np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


class ForceArrows:
    """An arrow for each contact, as long as its force is strong.

    Args:
        server: where.
        forces: the contacts.
    """

    def __init__(self, server: viser.ViserServer, forces: Forces) -> None:
        self._forces = forces
        self._shown = True
        self._arrows = server.scene.add_arrows(
            "/forces",
            np.zeros((1, 2, 3), dtype=np.float32),
            FORCE,
            shaft_radius=THICKNESS,
            head_radius=2.4 * THICKNESS,
            head_length=5.0 * THICKNESS,
            visible=False,
        )

    def show(self, shown: bool, k: int) -> None:
        """Show or hide them."""
        self._shown = shown
        self.place(k)

    def place(self, k: int) -> None:
        """The contacts at time number k."""
        pushes = self._forces.at(k) if self._shown else ()
        if pushes:
            self._arrows.points = np.stack([self._forces.arrow(push) for push in pushes]).astype(np.float32)
        if self._arrows.visible != bool(pushes):
            self._arrows.visible = bool(pushes)
