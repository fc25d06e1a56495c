"""A drawing in the browser with viser: frames as moving nodes, surfaces as meshes below them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, Protocol, get_args

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Transform
from manipcli.render.drawing import WORLD, Drawable, Drawing, ground_height
from manipcli.render.placing import Poses
from manipcli.replay.camera import framing
from manipcli.replay.renderer import sky
from manipcli.shapes.primitives import Rgba

if TYPE_CHECKING:
    import viser

AXES = 0.04
"""Length of the axes of a frame relative to the initial distance of the camera."""
CLEAR = 0.35
"""Opacity of transparent visual meshes."""
GRID = 0.1
"""Cell size of the ground grid [m]."""
STILL = 2e-5
"""[m], and of quaternions: what moved less is not sent. A robot at rest sends nothing."""
DARK = 0.18
"""Brightness of the dark background relative to the light one."""
MARKED = (224, 49, 49)
"""Colour of parts that collide."""
BRIGHTNESS = 0.7
"""Intensity of the environment light; 1 looks washed out."""


Shown = Literal["visual", "collision", "inertia", "frames", "names"]
"""Layers that can be shown or hidden."""


class _Node(Protocol):
    visible: bool


class ViserScene:
    """Shows one drawing on one server.

    Args:
        server: the viser server.
        drawing: the drawing.
        poses: initial poses of its frames; they set the camera.
        floors: frames of the floors, which are drawn as a grid with shadows.
    """

    def __init__(self, server: viser.ViserServer, drawing: Drawing, poses: Poses, *, floors: frozenset[str]) -> None:
        self._server = server
        self._nodes: list[viser.FrameHandle] = []
        self._layers: dict[Shown, list[_Node]] = {layer: [] for layer in get_args(Shown)}
        self._solid: list[tuple[viser.MeshHandle, float]] = []
        self._named: list[tuple[str, viser.FrameHandle, viser.LabelHandle]] = []
        self._meshes: list[tuple[str, viser.MeshHandle, tuple[int, int, int]]] = []
        self._shown: set[Shown] = {"visual"}
        self._found, self._marked = "", frozenset[str]()
        camera = framing(drawing, poses, leave_out=floors).further(1.2)
        self._length = AXES * float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
        # viser includes its lighting presets: no download.
        server.scene.configure_environment_map("warehouse", environment_intensity=BRIGHTNESS)
        self.darken(False)
        self.paths = paths = {frame: _path(frame, k) for k, frame in enumerate(drawing.frames)}
        with server.atomic():
            for frame in drawing.frames:
                self._nodes.append(server.scene.add_frame(paths[frame], show_axes=False))
                if frame != WORLD and frame not in floors:
                    self._frame(f"{paths[frame]}/frame", frame.removeprefix("robot/"))
            for k, mark in enumerate(drawing.marks):
                self._frame(f"{paths[mark.frame]}/mark_{k}", mark.name, mark.X_FM)
            for k, drawable in enumerate(drawing.drawables):
                if drawable.frame not in floors:
                    self._mesh(f"{paths[drawable.frame]}/{drawable.layer}_{k}", drawable)
        self._placed = _Placed(len(drawing.frames))
        self.place(poses)
        server.scene.add_grid(  # for the shadows
            "/ground",
            width=6.0,
            height=6.0,
            cell_size=GRID,
            section_size=10 * GRID,
            cell_color=(205, 210, 216),
            section_color=(165, 172, 180),
            shadow_opacity=0.25,
            position=(0.0, 0.0, ground_height(drawing, poses, floors)),
        )
        start = server.initial_camera
        start.position, start.look_at, start.up = camera.eye, camera.target, (0.0, 0.0, 1.0)
        start.fov = float(np.radians(camera.field))

    def _frame(self, path: str, label: str, X: Transform | None = None) -> None:
        """Axes and a name in separate nodes, since each is shown without the other; both start hidden."""
        X = X or Transform.identity()
        axes = self._server.scene.add_frame(
            path,
            axes_length=self._length,
            axes_radius=self._length / 24.0,
            origin_radius=self._length / 14.0,
            position=X.p,
            wxyz=np.roll(X.quat_xyzw, 1),
            visible=False,
        )
        name = self._server.scene.add_label(
            f"{path}_name", label, position=X.p, visible=False, font_screen_scale=0.75, anchor="bottom-left"
        )
        self._named.append((label, axes, name))

    def _mesh(self, path: str, drawable: Drawable) -> None:
        clear = drawable.rgba[3]
        mesh = self._server.scene.add_mesh_simple(
            path,
            drawable.surface.vertices.astype(np.float32),
            drawable.surface.faces.astype(np.uint32),
            color=_rgb(drawable.rgba),
            opacity=clear if clear < 1.0 else None,
            side="double",
            visible=drawable.layer == "visual",
            cast_shadow=clear >= 1.0,
            receive_shadow=False,  # only on the ground: shadow maps flicker on thin walls
        )
        self._layers[drawable.layer].append(mesh)
        self._meshes.append((drawable.frame, mesh, _rgb(drawable.rgba)))
        if drawable.layer == "visual":
            self._solid.append((mesh, clear))

    def place(self, poses: Poses) -> None:
        """Move all frames to the poses of one state; the browser shows them in one update, of what moved visibly."""
        with self._server.atomic():
            for k in np.flatnonzero(self._placed.moved(poses)).tolist():
                self._nodes[k].position = poses.position[k]
                self._nodes[k].wxyz = np.roll(poses.quat_xyzw[k], 1)

    def show(self, layer: Shown, shown: bool) -> None:
        """Show or hide a layer: surfaces, the axes of all frames and marks, or their names."""
        if shown:
            self._shown.add(layer)
        else:
            self._shown.discard(layer)
        for node in self._layers[layer]:
            node.visible = shown
        if layer in ("frames", "names"):
            self._show_frames()

    def find(self, text: str) -> None:
        """Of frames and names, show only those that have `text` in their name."""
        self._found = text.strip().lower()
        self._show_frames()

    def _show_frames(self) -> None:
        for label, axes, name in self._named:
            found = self._found in label.lower()
            axes.visible = found and "frames" in self._shown
            name.visible = found and "names" in self._shown

    def resize(self, factor: float) -> None:
        """Draw the axes of frames `factor` times as long as at first."""
        length = factor * self._length
        for _, axes, _ in self._named:
            axes.axes_length, axes.axes_radius, axes.origin_radius = length, length / 24.0, length / 14.0

    def darken(self, dark: bool) -> None:
        """A dark or a light background, in all browsers."""
        background = np.repeat(sky(64), 64, axis=1)
        self._server.scene.set_background_image((background * (DARK if dark else 1.0)).astype(np.uint8))

    def wireframe(self, on: bool) -> None:
        """Draw the edges of the triangles of all surfaces instead of the surfaces."""
        for _, mesh, _ in self._meshes:
            mesh.wireframe = on

    def mark(self, frames: frozenset[str]) -> None:
        """Draw the surfaces of these frames in red, all others in their own colours."""
        if frames == self._marked:
            return
        changed, self._marked = frames ^ self._marked, frames
        for frame, mesh, rgb in self._meshes:
            if frame in changed:
                mesh.color = MARKED if frame in frames else rgb

    def see_through(self, clear: bool) -> None:
        """Make the visual meshes transparent or opaque."""
        for mesh, opacity in self._solid:
            mesh.opacity = CLEAR * opacity if clear else (opacity if opacity < 1.0 else None)


class _Placed:
    """The poses of frames that browsers show."""

    def __init__(self, frames: int) -> None:
        self._position, self._quat = np.full((frames, 3), np.inf), np.full((frames, 4), np.inf)

    def moved(self, poses: Poses) -> npt.NDArray[np.bool_]:
        """(F,) whether each frame is visibly elsewhere than at its last move, which this call is."""
        far: npt.NDArray[np.bool_] = np.abs(poses.position - self._position).max(axis=1) > STILL
        far |= np.abs(poses.quat_xyzw - self._quat).max(axis=1) > STILL
        self._position[far], self._quat[far] = poses.position[far], poses.quat_xyzw[far]
        return far


def _path(frame: str, k: int) -> str:
    """A unique path of two parts for a frame, because viser splits names at slashes."""
    name = frame.removeprefix("robot/").replace("/", "|")
    return "/world" if frame == WORLD else f"/{'robot' if frame.startswith('robot/') else 'scene'}/{k}_{name}"


def _rgb(rgba: Rgba) -> tuple[int, int, int]:
    r, g, b = (round(255 * min(max(value, 0.0), 1.0)) for value in rgba[:3])
    return (r, g, b)
