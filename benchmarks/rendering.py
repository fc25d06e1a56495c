"""What a picture costs: 320x240 at the start of the pour, depth, parts and colours, by several renderers.

python -m benchmarks.rendering            # with embreex and trimesh, if they are installed: also embree

Processor time of the process, median of 15 pictures after one that does not count; the differences of depth are from
ours, in pixels that both see.
"""

from __future__ import annotations

import importlib.util
import math
import statistics
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from manipcli.control.compiled import library
from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import configuration
from manipcli.model.state import WorldState
from manipcli.render.drawing import draw, floors_of
from manipcli.render.lens import Lens
from manipcli.render.placing import Placing
from manipcli.render.scan import Scan
from manipcli.render.scene_camera import SceneCamera, View
from manipcli.render.stage import Stage
from manipcli.replay.camera import framing
from manipcli.replay.renderer import Renderer
from manipcli.simulate.camera_messages import points
from manipcli.simulate.depth_noise import CameraLimits, CameraNoise, DepthMeasurement
from manipcli.task.load_task import load_task
from manipcli.task.task import Task

LENS = Lens.of_field(320, 240, math.radians(70.0))
EYE, TARGET = np.array([1.9, -1.1, 1.2]), np.array([0.55, 0.1, 0.5])
KINECT = {"depth": {"white": 1.2e-3, "quadratic": 1.9e-3, "offset": 0.4, "grazing": 1e-4}}
Row = tuple[str, float, str]


def milliseconds(work: Callable[[], object], rounds: int = 15) -> float:
    """Median processor time."""
    taken = []
    for _ in range(rounds + 1):
        began = time.process_time()
        work()
        taken.append(time.process_time() - began)
    return 1000.0 * statistics.median(taken[1:])


def difference(ours: Array, other: Array) -> str:
    """How another depth picture differs from ours."""
    both = np.isfinite(ours) & np.isfinite(other)
    error = np.abs(ours[both] - other[both])
    seen = int((np.isfinite(ours) != np.isfinite(other)).sum())
    share = 100.0 * (error > 1e-3).mean()
    return f"median {1e3 * np.median(error):.3g} mm, {share:.3g} % above 1 mm, {seen} pixels seen by one only"


def own(stage: Stage, state: WorldState, X_WC: Transform) -> Iterator[Row]:
    """Our rows."""
    for name in ("", " without compiled kernels"):
        before = library.use(None) if name else None
        camera = SceneCamera(stage, LENS)
        if name:
            library.use(before)
        view = camera.view(state, X_WC)
        rounds = 3 if name else 15
        yield (
            f"ours{name}: depth, parts",
            milliseconds(partial(camera.shoot, view, colour=False), rounds),
            "definition",
        )
    camera = SceneCamera(stage, LENS)
    shape = (LENS.height, LENS.width)
    measurement, rng = (
        DepthMeasurement(CameraNoise.model_validate(KINECT), CameraLimits(), shape, 0.04),
        np.random.default_rng(0),
    )

    def frame(cloud: bool) -> None:
        shot = camera.shoot(camera.view(state, X_WC))
        depth = measurement.measure(shot.depth, shot.cosine, measurement.draw(rng))
        if cloud:
            points(LENS.points(depth), shot.colour)

    yield "ours: poses, depth, parts, colours", milliseconds(lambda: camera.shoot(camera.view(state, X_WC))), ""
    yield "the same with noise by distance and angle", milliseconds(lambda: frame(False)), ""
    yield "the same with a cloud of coloured points", milliseconds(lambda: frame(True)), ""
    scan = Scan(stage.surfaces, np.linspace(-2.0, 2.0, 683), 5.6)
    X_WS = Transform.of(xyz=(0.3, -0.6, 0.5), rpy=(0.0, 0.0, 0.8))
    yield "a scan of 683 rays over 240 deg", milliseconds(lambda: scan.distances(*stage.poses(state, X_WS))), ""


def pictures(task: Task) -> Iterator[Row]:
    """Pictures of runs, in which robot and bodies move."""
    drawing, placing = draw(task.robot, task.scene), Placing(task.robot, task.scene)
    poses = placing.start(configuration(task.robot))
    for size in ((640, 480), (960, 720)):
        camera = framing(drawing, poses, leave_out=floors_of(task.scene))
        for name, shadows in (("", False), (" with shadows", True)):
            renderer = Renderer(drawing, size=size, still=placing.still, shadows=shadows)
            took = milliseconds(partial(renderer.picture, poses, camera))
            yield f"a picture of a run, {size[0]}x{size[1]}{name}", took, ""


def tiny(stage: Stage, view: View, depth: Array) -> Iterator[Row]:
    """PyBullet's software renderer; the surfaces are placed in the optical frame."""
    import pybullet

    client, near, far = pybullet.connect(pybullet.DIRECT), 0.05, 10.0
    meshes = []
    for each, colour in zip(stage.surfaces, stage.colours, strict=True):
        visual = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=each.vertices.tolist(),
            indices=each.faces.ravel().tolist(),
            normals=each.normals.tolist(),
            rgbaColor=[*colour, 1.0],
            physicsClientId=client,
        )
        meshes.append(pybullet.createMultiBody(0.0, -1, visual, physicsClientId=client))
    quats = [Transform.of(R=R).quat_xyzw.tolist() for R in view.rotation]
    right, up = near * 160.0 / LENS.fx, near * 120.0 / LENS.fy
    views = pybullet.computeViewMatrix((0, 0, 0), (0, 0, 1), (0, -1, 0))
    projection = pybullet.computeProjectionMatrix(-right, right, -up, up, near, far)

    def work() -> Any:
        for mesh, p, quat in zip(meshes, view.position.tolist(), quats, strict=True):
            pybullet.resetBasePositionAndOrientation(mesh, p, quat, physicsClientId=client)
        tiny = pybullet.ER_TINY_RENDERER
        return pybullet.getCameraImage(320, 240, views, projection, shadow=0, renderer=tiny, physicsClientId=client)

    buffer, seen = (np.reshape(each, (240, 320)) for each in work()[3:5])
    found = np.where(seen >= 0, far * near / (far - (far - near) * buffer), np.inf)
    yield "PyBullet's TinyRenderer, with the placing of the meshes", milliseconds(work), difference(depth, found)
    pybullet.disconnect(client)


def embree(vertices: Array, faces: Array, depth: Array) -> Iterator[Row]:
    """Embree, alone and through trimesh."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    d = np.stack(np.broadcast_arrays(LENS.columns, LENS.rows[:, None], 1.0), axis=-1).reshape(-1, 3).astype(np.float32)
    o, corners, index = np.zeros_like(d), vertices.astype(np.float32), faces.astype(np.int32)

    def build() -> Any:
        scene = EmbreeScene()
        TriangleMesh(scene, corners, index)
        scene.run(o[:1], d[:1], query="DISTANCE")
        return scene

    scene = build()
    z = scene.run(o, d, query="DISTANCE").reshape(depth.shape)
    text = difference(depth, np.where(z < 1e30, z, np.inf))
    yield "embree, the rays alone: depth", milliseconds(lambda: scene.run(o, d, query="DISTANCE")), text
    yield "embree, the scene, which is built for each picture", milliseconds(build), ""
    if importlib.util.find_spec("trimesh"):
        import trimesh
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        through = RayMeshIntersector(trimesh.Trimesh(corners, index, process=False))
        work = partial(through.intersects_location, o, d, multiple_hits=False)
        yield "embree through trimesh, the rays alone", milliseconds(work), ""


def main() -> None:
    """Prints the table."""
    task = load_task(Path("tasks/pour.yaml"))
    state = WorldState.room(len(task.robot.joint_names), len(task.scene.movable))
    state.position[:] = configuration(task.robot)
    for k, body in enumerate(task.scene.movable):
        state.body_position[k], state.body_quat_xyzw[k] = body.X_WO.p, body.X_WO.quat_xyzw
    z = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    x = np.cross(z, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(z, (0.0, 0.0, 1.0)))
    X_WC = Transform.of(xyz=EYE, R=np.stack([x, np.cross(z, x), z], axis=1))
    stage = Stage(task.robot, task.scene)
    camera = SceneCamera(stage, LENS)
    view = camera.view(state, X_WC)
    depth = camera.shoot(view).depth
    moved = [each.vertices @ R.T + p for each, R, p in zip(stage.surfaces, view.rotation, view.position, strict=True)]
    firsts = np.cumsum([0, *(len(each) for each in moved)])
    faces = np.concatenate([each.faces + first for each, first in zip(stage.surfaces, firsts, strict=False)])
    rows = [*own(stage, state, X_WC), *pictures(task), *tiny(stage, view, depth)]
    if importlib.util.find_spec("embreex"):
        rows += embree(np.concatenate(moved), faces, depth)
    print(f"{len(stage.surfaces)} surfaces, {len(faces)} triangles\n\n| renderer | ms | depth |\n|---|---|---|")
    for name, took, text in rows:
        print(f"| {name} | {took:.3g} | {text} |")


if __name__ == "__main__":
    main()
