"""Pictures of robots and scenes as PNG files: no window, no GPU, the same bytes every time.

Bullet's TinyRenderer draws surfaces of ours (it reads no file), twice as large in each direction; the average of four
pixels smooths the edges.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState
from manipcli.replay.camera import Camera, framing
from manipcli.replay.drawing import Drawable, Drawing, Layer, draw
from manipcli.replay.image import Image, sky, write_png
from manipcli.replay.placing import Placing, Poses
from manipcli.replay.posture import following, posture
from manipcli.replay.surface import Surface, surface

SIZE = (960, 720)
"""Of a picture [pixel]."""
FINER = 2
"""Rendered this many times larger."""
MAX_VERTICES = 60_000
"""Of one surface in Bullet, whose commands hold some more than twice as many."""
FLOOR = "floor"
"""The kind of body that everything stands on."""


@dataclass(frozen=True, slots=True)
class Light:
    """Towards the light in the world; how bright what faces it, what does not, and what mirrors it."""

    direction: tuple[float, float, float] = (0.35, 0.55, 1.0)
    ambient: float = 0.62
    diffuse: float = 0.42
    specular: float = 0.08


class Studio:
    """A drawing in a Bullet client that only draws. A context manager: the client ends with it.

    Args:
        drawing: what there is.
        layers: which of it is shown.
        size: width and height of the pictures [pixel].
        light: the light.
    """

    def __init__(
        self,
        drawing: Drawing,
        *,
        layers: tuple[Layer, ...] = ("visual",),
        size: tuple[int, int] = SIZE,
        light: Light = Light(),
    ) -> None:
        from manipcli.simulate.quiet import silence

        with silence():  # its banner
            import pybullet

        self._bullet = pybullet
        self._size = size
        self._light = light
        self._frames = {name: k for k, name in enumerate(drawing.frames)}
        self._client: int = pybullet.connect(pybullet.DIRECT)
        self._bodies: list[tuple[int, str]] = []
        for one in drawing.drawables:
            if one.layer in layers and one.rgba[3] > 0.0:
                self._bodies += [(self._add(part, one), one.frame) for part in _parts(one.surface)]

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._bullet.disconnect(self._client)

    def _add(self, part: Surface, drawable: Drawable) -> int:
        visual = self._bullet.createVisualShape(
            self._bullet.GEOM_MESH,
            vertices=part.vertices.tolist(),
            indices=part.faces.ravel().tolist(),
            normals=part.normals.tolist(),
            rgbaColor=list(drawable.rgba),
            specularColor=[1.0, 1.0, 1.0],
            physicsClientId=self._client,
        )
        return int(self._bullet.createMultiBody(0.0, -1, visual, physicsClientId=self._client))

    def picture(self, poses: Poses, camera: Camera) -> Image:
        """What the camera sees at one instant, with the sky behind."""
        for body, frame in self._bodies:
            k = self._frames[frame]
            self._bullet.resetBasePositionAndOrientation(
                body, poses.position[k].tolist(), poses.quat_xyzw[k].tolist(), physicsClientId=self._client
            )
        width, height = (FINER * pixels for pixels in self._size)
        distance = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
        _, _, pixels, _, seen = self._bullet.getCameraImage(
            width,
            height,
            self._bullet.computeViewMatrix(camera.eye, camera.target, (0.0, 0.0, 1.0)),
            self._bullet.computeProjectionMatrixFOV(
                camera.field, self._size[0] / self._size[1], distance / 50.0, distance * 12.0
            ),
            lightDirection=self._light.direction,
            lightColor=(1.0, 1.0, 1.0),
            lightAmbientCoeff=self._light.ambient,
            lightDiffuseCoeff=self._light.diffuse,
            lightSpecularCoeff=self._light.specular,
            shadow=0,
            renderer=self._bullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        rgb = np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[..., :3]
        whole = np.where(np.asarray(seen).reshape(height, width, 1) < 0, sky(height), rgb)
        small = whole.reshape(self._size[1], FINER, self._size[0], FINER, 3).mean(axis=(1, 3))
        image: Image = small.round().astype(np.uint8)
        return image


def _parts(whole: Surface) -> list[Surface]:
    """A surface in pieces that fit into one command of Bullet."""
    if len(whole.vertices) <= MAX_VERTICES:
        return [whole]
    parts = []
    for first in range(0, len(whole.faces), MAX_VERTICES // 3):
        used, faces = np.unique(whole.faces[first : first + MAX_VERTICES // 3], return_inverse=True)
        parts.append(surface(whole.vertices[used], faces))
    return parts


def draw_robot(
    robot: RobotModel,
    path: Path,
    *,
    pose: str | None = None,
    layers: tuple[Layer, ...] = ("visual",),
    size: tuple[int, int] = SIZE,
    camera: Camera | None = None,
) -> tuple[str, ...]:
    """A picture of a robot as a PNG file.

    Args:
        robot: the robot.
        path: of the file; replaced.
        pose: a named pose; `home` or else zero where None.
        layers: visual, collision, inertia.
        size: width and height [pixel].
        camera: None frames the robot.

    Returns:
        What could not be drawn, a line each.
    """
    drawing = draw(robot)
    return _draw(drawing, Placing(robot).start(posture(robot, pose)), path, layers, size, camera, frozenset())


def draw_scene(
    robot: RobotModel | None,
    scene: Scene,
    state: WorldState | Array | None,
    path: Path,
    *,
    layers: tuple[Layer, ...] = ("visual",),
    size: tuple[int, int] = SIZE,
    camera: Camera | None = None,
) -> tuple[str, ...]:
    """A picture of a scene with its robot as a PNG file.

    Args:
        robot: the robot, or None.
        scene: the scene.
        state: one instant; or joint positions (n,), with the bodies where they start; None: `home`, or else zero.
        path: of the file; replaced.
        layers, size, camera: as for `draw_robot`; the floor need not be in view.

    Returns:
        What could not be drawn, a line each.
    """
    placing = Placing(robot, scene)
    if isinstance(state, WorldState):
        poses = placing.at(state.position, state.body_position, state.body_quat_xyzw)
    elif robot is None:
        poses = placing.start()
    else:
        poses = placing.start(posture(robot) if state is None else following(robot, state))
    floors = frozenset(body.name for body in scene.bodies if body.kind == FLOOR)
    return _draw(draw(robot, scene), poses, path, layers, size, camera, floors)


def _draw(
    drawing: Drawing,
    poses: Poses,
    path: Path,
    layers: tuple[Layer, ...],
    size: tuple[int, int],
    camera: Camera | None,
    leave_out: frozenset[str],
) -> tuple[str, ...]:
    chosen = camera or framing(drawing, poses, aspect=size[0] / size[1], leave_out=leave_out)
    with Studio(drawing, layers=layers, size=size) as studio:
        write_png(path, studio.picture(poses, chosen))
    return drawing.missing
