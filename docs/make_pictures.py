"""Draws the picture of a run from its log: nothing is simulated again.

    manipcli run tasks/pour.yaml
    python docs/make_pictures.py                                                   (writes docs/pour.png)
    python docs/make_pictures.py runs/pick_place.mcap --task tasks/pick_place.yaml --out runs/pick_place.png

The states come from the log, the meshes of the robot from the files that the task names. Bullet's TinyRenderer draws
without a GPU and without a window, at twice the size, which Pillow then halves to smooth the edges.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from xml.sax.saxutils import quoteattr

import numpy as np
import pybullet
from PIL import Image, ImageDraw, ImageFont

from manipcli.core.geometry import Transform
from manipcli.flow.load import Task, load_task
from manipcli.model.robot import Box, Cylinder, Mesh, RobotModel, Shape, Sphere
from manipcli.model.scene import Body, Scene
from manipcli.model.scene_file import scene_from_json
from manipcli.model.state import WorldState
from manipcli.plan.steps.move import MoveSpec
from manipcli.record.reading import read_recording
from manipcli.record.recording import Recording
from manipcli.spec.task import TaskSpec

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = 3
PANEL = (500, 400)
"""Of one picture [pixel]."""
FINER = 2
"""Rendered this many times larger."""
GAP = 6
SKY = ((203, 213, 224), (246, 248, 250))
"""Behind everything, from top to bottom."""
INK = (30, 36, 44)
HALF_WAY = 0.6
"""A thing that falls is shown when it has this part of its greatest speed."""


@dataclass(frozen=True)
class Camera:
    """Looks from `eye` at `target` [m] in the world; `field` of view from top to bottom [deg]."""

    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    field: float

    @property
    def view(self) -> list[float]:
        return list(pybullet.computeViewMatrix(self.eye, self.target, (0.0, 0.0, 1.0)))

    @property
    def projection(self) -> list[float]:
        return list(pybullet.computeProjectionMatrixFOV(self.field, PANEL[0] / PANEL[1], 0.05, 12.0))


@dataclass(frozen=True)
class Moment:
    """What is shown, and when [s]."""

    label: str
    time: float


class Stage:
    """Robot and scene in a Bullet client that only draws."""

    def __init__(self, robot: RobotModel, scene: Scene) -> None:
        self._scene = scene
        self._client = pybullet.connect(pybullet.DIRECT)
        self._bodies = {body.name: self._add(body) for body in scene.bodies}
        with TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(_drawable(robot), encoding="utf-8")
            X = robot.X_WB
            self._robot = pybullet.loadURDF(str(file), list(X.p), list(X.quat_xyzw), useFixedBase=True)
        infos = [pybullet.getJointInfo(self._robot, k) for k in range(pybullet.getNumJoints(self._robot))]
        index = {info[1].decode(): k for k, info in enumerate(infos)}
        self._joints = [index[name] for name in robot.joint_names]

    def __enter__(self) -> Stage:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        pybullet.disconnect(self._client)

    def _add(self, body: Body) -> list[tuple[int, Transform]]:
        """A Bullet body for each shape, with X_OS: several shapes of one body cannot have colours of their own."""
        return [
            (pybullet.createMultiBody(0.0, -1, _drawn(g.shape, g.rgba or (0.7, 0.7, 0.7, 1.0))), g.X_LS)
            for g in body.geometries
        ]

    def show(self, state: WorldState) -> None:
        """Put everything where it is in one state."""
        for joint, position in zip(self._joints, state.position, strict=True):
            pybullet.resetJointState(self._robot, joint, float(position))
        for body in self._scene.bodies:
            X_WO = body.X_WO
            if not body.fixed:
                k = self._scene.movable.index(body)
                X_WO = Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k])
            for k, X_OS in self._bodies[body.name]:
                X_WS = X_WO @ X_OS
                pybullet.resetBasePositionAndOrientation(k, list(X_WS.p), list(X_WS.quat_xyzw))

    def picture(self, camera: Camera) -> Image.Image:
        """What the camera sees, with the sky behind."""
        width, height = (FINER * pixels for pixels in PANEL)
        _, _, pixels, _, seen = pybullet.getCameraImage(
            width,
            height,
            camera.view,
            camera.projection,
            lightDirection=(0.35, 0.55, 1.0),
            lightColor=(1.0, 1.0, 1.0),
            lightAmbientCoeff=0.62,
            lightDiffuseCoeff=0.42,
            lightSpecularCoeff=0.08,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
        )
        rgb = np.asarray(pixels, dtype=np.uint8).reshape(height, width, 4)[..., :3]
        part = np.linspace(0.0, 1.0, height)[:, None, None]
        sky = (1.0 - part) * np.array(SKY[0]) + part * np.array(SKY[1])
        empty = np.asarray(seen).reshape(height, width, 1) < 0
        whole = np.where(empty, sky.round().astype(np.uint8), rgb).astype(np.uint8)
        return Image.fromarray(whole).resize(PANEL, Image.Resampling.LANCZOS)


def _drawable(robot: RobotModel) -> str:
    """The description with the meshes' own files: those that engines get have neither normals nor colours."""
    text = robot.urdf
    for link in robot.links:
        for geometry in (*link.visuals, *link.collisions):
            if isinstance(geometry.shape, Mesh):
                text = text.replace(quoteattr(geometry.shape.uri), quoteattr(str(geometry.shape.path)))
    return text


def _drawn(shape: Shape, rgba: Sequence[float]) -> int:
    """A Bullet visual shape."""
    match shape:
        case Box(size):
            half = [length / 2 for length in size]
            return int(pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=half, rgbaColor=rgba))
        case Sphere(radius):
            return int(pybullet.createVisualShape(pybullet.GEOM_SPHERE, radius=radius, rgbaColor=rgba))
        case Cylinder(radius, length):
            return int(pybullet.createVisualShape(pybullet.GEOM_CYLINDER, radius, length=length, rgbaColor=rgba))
        case Mesh(_, path, scale):
            file = str(path)
            return int(pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=file, meshScale=scale, rgbaColor=rgba))


WORDS = {"pick": "grasped", "lift": "lifted", "pour": "pouring", "place": "placed", "move": "moved", "follow": "moved"}
"""What is to be seen after a step; the other steps change nothing that could be drawn."""


def moments(recording: Recording, task: TaskSpec) -> Iterator[Moment]:
    """The start, and each step when it is done; a pour while something falls."""
    yield Moment("start", 0.0)
    begun = {event.step: event.time for event in recording.events if event.kind == "step_started"}
    named = {step.id: step.body.to for step in task.steps if isinstance(step.body, MoveSpec)}
    for event in recording.events:
        if event.kind == "step_ended" and event.verb in WORDS:
            to = named.get(event.step)
            time = _falling(recording.states, begun[event.step], event.time) if event.verb == "pour" else event.time
            yield Moment(to if isinstance(to, str) else WORDS[event.verb], time)


def _falling(states: WorldState, first: float, last: float) -> float:
    """Half-way down of the body that falls fastest between two times."""
    within = np.flatnonzero((states.time >= first) & (states.time <= last))
    down = -states.body_linear[within, :, 2]
    fastest = down[:, int(down.max(axis=0).argmax())]
    return float(states.time[within[int(np.argmax(fastest >= HALF_WAY * fastest.max()))]])


def sheet(recording: Recording, task: Task, camera: Camera) -> Image.Image:
    """All moments on one sheet, row by row."""
    shown = list(moments(recording, task.spec))
    rows = -(-len(shown) // COLUMNS)
    width, height = (n * (size + GAP) - GAP for n, size in zip((COLUMNS, rows), PANEL, strict=True))
    whole = Image.new("RGB", (width, height), "white")
    with Stage(task.robot, scene_from_json(recording.attachments["scene.json"])) as stage:
        for number, moment in enumerate(shown):
            tick = min(int(np.searchsorted(recording.states.time, moment.time)), len(recording.states.time) - 1)
            now = recording.states.map(itemgetter(tick))
            stage.show(now)
            panel = stage.picture(camera)
            _caption(panel, f"{number + 1}  {moment.label}", f"{float(now.time):.2f} s")
            row, column = divmod(number, COLUMNS)
            whole.paste(panel, (column * (PANEL[0] + GAP), row * (PANEL[1] + GAP)))
    return whole


def _caption(panel: Image.Image, left: str, right: str) -> None:
    draw = ImageDraw.Draw(panel)
    draw.text((14, 10), left, fill=INK, font=ImageFont.load_default(21))
    draw.text((PANEL[0] - 14, 12), right, fill=INK, font=ImageFont.load_default(18), anchor="ra")


CAMERA = Camera(eye=(1.72, 1.05, 1.08), target=(0.375, 0.085, 0.51), field=32.0)


def main() -> None:
    """Draw one log."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, nargs="?", default=Path("runs/pour.mcap"))
    parser.add_argument("--task", type=Path, default=ROOT / "tasks" / "pour.yaml", help="names the robot in the log")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pour.png")
    chosen = parser.parse_args()
    sheet(read_recording(chosen.log), load_task(chosen.task), CAMERA).save(chosen.out, optimize=True)


if __name__ == "__main__":
    main()
