"""What the page draws: surfaces, frames and how they move, contact forces, as JSON and arrays in its pack."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import WORLD, Drawing, floors_of, ground_height, link_frame
from manipcli.render.placing import Poses
from manipcli.render.surface import Surface
from manipcli.replay.camera import framing
from manipcli.replay.forces import LONGEST, Forces
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback
from manipcli.scene.scene import Scene


def scene_json(playback: Playback, drawing: Drawing, pack: Pack) -> Json:
    """Camera, frames, surfaces and contact forces of a run; `drawing`: of its robot and scene."""
    poses = playback.poses()
    frames, order = _frames(drawing, playback.robot, playback.scene)
    floors = floors_of(playback.scene)
    index = {name: k for k, name in enumerate(drawing.frames)}
    start = Poses(poses.position[0], poses.quat_xyzw[0])
    camera = framing(drawing, start, leave_out=floors).further(1.2)
    surfaces, drawables = _drawables(drawing, index, floors, pack)
    path = playback.tool_path()
    return {
        "camera": {"eye": camera.eye, "target": camera.target, "field": camera.field},
        "ground": ground_height(drawing, start, floors),
        "frames": frames,
        "order": order,
        "axes": _axes(drawing, index, floors),
        "surfaces": surfaces,
        "drawables": drawables,
        "path": pack.add(path, "f") if len(path) > 1 else None,
        "pushes": _pushes(playback, poses, pack),
    }


def _frames(drawing: Drawing, robot: RobotModel | None, scene: Scene | None) -> tuple[list[Json], list[int]]:
    """How each frame of a drawing moves, and an order with each frame after its parent."""
    index = {name: k for k, name in enumerate(drawing.frames)}
    found: list[Json] = [{"p": (0.0, 0.0, 0.0), "q": (0.0, 0.0, 0.0, 1.0)}]
    order = [0]
    if robot is not None:
        above = {joint.child: joint for joint in robot.joints}
        number = {name: k for k, name in enumerate(robot.joint_names)}
        for link in robot.links:
            joint = above.get(link.name)
            if joint is None:
                found.append(_pose(robot.X_WB))
                continue
            frame = {"parent": index[link_frame(joint.parent)], **_pose(joint.X_PJ)}
            if joint.moves:
                frame |= {"joint": number[joint.name], "axis": joint.axis.tolist()}
                frame |= {"slides": True} if joint.type == "prismatic" else {}
            found.append(frame)
        order.append(index[link_frame(robot.root)])
        order += [index[link_frame(joint.child)] for joint in robot.joints]
    movable = 0
    for body in scene.bodies if scene is not None else ():
        order.append(index[body.name])
        found.append(_pose(body.X_WO) if body.fixed else {"body": movable})
        movable += not body.fixed
    return found, order


def _pose(X: Transform) -> Json:
    return {"p": X.p.tolist(), "q": X.quat_xyzw.tolist()}


def _axes(drawing: Drawing, index: dict[str, int], floors: frozenset[str]) -> list[Json]:
    """Frames shown as named axes: every frame except the world, and the marks."""
    shown: list[Json] = [
        {"name": frame.removeprefix("robot/"), "frame": index[frame]}
        for frame in drawing.frames
        if frame != WORLD and frame not in floors
    ]
    return shown + [{"name": mark.name, "frame": index[mark.frame], **_pose(mark.X_FM)} for mark in drawing.marks]


def _drawables(
    drawing: Drawing, index: dict[str, int], floors: frozenset[str], pack: Pack
) -> tuple[list[Json], list[Json]]:
    """Distinct surfaces, and the drawables that use them."""
    surfaces: list[Json] = []
    known: dict[bytes, int] = {}
    drawables: list[Json] = []
    for shape in drawing.layer("visual"):
        if shape.frame in floors or not len(shape.surface.faces):
            continue
        key = shape.surface.vertices.tobytes() + shape.surface.faces.tobytes()
        if key not in known:
            known[key] = len(surfaces)
            surfaces.append(_surface(shape.surface, pack))
        drawable: Json = {"surface": known[key], "frame": index[shape.frame], "rgba": [round(c, 4) for c in shape.rgba]}
        drawables.append(drawable | ({"robot": True} if shape.frame.startswith("robot/") else {}))
    return surfaces, drawables


def _surface(surface: Surface, pack: Pack) -> Json:
    """Vertices as 1/65535 of their box (5 um for a link of 0.3 m), normals as 1/127, four numbers per row."""
    low = surface.vertices.min(axis=0)
    size = np.maximum(np.ptp(surface.vertices, axis=0), 1e-9)
    count = len(surface.vertices)
    places = np.zeros((count, 4))
    places[:, :3] = np.round((surface.vertices - low) / size * 65535.0)
    normals = np.zeros((count, 4))
    normals[:, :3] = np.round(surface.normals * 127.0)
    return {
        "places": pack.add(places, "H"),
        "normals": pack.add(normals, "b"),
        "faces": pack.add(surface.faces, "H" if count <= 65535 else "I"),
        "low": low.tolist(),
        "size": size.tolist(),
    }


def _pushes(playback: Playback, poses: Poses, pack: Pack) -> Json | None:
    """Rows of point, normal force and friction, and the first row of each time."""
    forces = Forces(playback, poses)
    if not forces.scale:
        return None
    pushes_at = [forces.at(k) for k in range(len(playback.times))]
    rows = [[*push.point, *push.normal, *push.friction] for pushes in pushes_at for push in pushes]
    return {
        "first": pack.add(np.cumsum([0, *map(len, pushes_at)]), "I"),
        # Rounded to 1e-6 without -0: further digits differ between processes.
        "rows": pack.add(np.round(np.array(rows).reshape(-1, 9), 6) + 0.0, "f"),
        "scale": forces.scale,
        "longest": LONGEST,
    }
