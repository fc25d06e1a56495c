"""What the page draws: surfaces, frames and how they move, contact forces, as JSON and arrays in its pack."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Transform, rotate
from manipcli.description.elements import Inertial
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import WORLD, Drawing, Layer, floors_of, ground_height, inertia_box, link_frame
from manipcli.render.placing import Placing, Poses
from manipcli.render.surface import Surface, joined
from manipcli.replay.camera import framing
from manipcli.replay.furniture import furniture
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback
from manipcli.replay.pushes_json import pushes_json
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Rgba

LOOKED_AT = 60
"""Number of states of a run that are in view."""


def scene_json(playback: Playback, drawing: Drawing, pack: Pack) -> Json:
    """Camera, frames, surfaces, inertias and contact forces of a run; `drawing`: of its robot and scene."""
    poses = playback.poses()
    count = len(playback.times)
    some = np.unique(np.linspace(0, count - 1, min(count, LOOKED_AT)).round().astype(int))
    seen = Poses(poses.position[some], poses.quat_xyzw[some])
    large = furniture(playback.scene, Placing(playback.robot, playback.scene), seen)
    frames, order = _frames(drawing, playback.robot, playback.scene)
    floors = floors_of(playback.scene)
    index = {name: k for k, name in enumerate(drawing.frames)}
    start = Poses(poses.position[0], poses.quat_xyzw[0])
    camera = framing(drawing, seen, leave_out=large | floors).further(1.05)
    surfaces = _Surfaces(pack)
    return {
        "camera": {"eye": camera.eye, "target": camera.target, "field": camera.field},
        "extent": _extent(drawing, seen, index, floors),
        "ground": ground_height(drawing, start, floors),
        "frames": frames,
        "order": order,
        "axes": _axes(drawing, index, floors),
        "drawables": _drawables(drawing, "visual", index, floors, surfaces),
        "collision": _drawables(drawing, "collision", index, floors, surfaces),
        "surfaces": surfaces.found,
        "inertias": _inertias(playback.robot, playback.scene, index),
        "pushes": pushes_json(playback, poses, index, pack),
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


def _extent(drawing: Drawing, poses: Poses, index: dict[str, int], floors: frozenset[str]) -> Json:
    """The sphere around all that is seen in several states, and casts shadows."""
    clouds = [
        rotate(poses.quat_xyzw[:, index[shape.frame], None], shape.surface.corners)
        + poses.position[:, index[shape.frame], None]
        for shape in drawing.layer("visual")
        if shape.frame not in floors and len(shape.surface.faces)
    ]
    points = np.concatenate([cloud.reshape(-1, 3) for cloud in clouds]) if clouds else np.zeros((1, 3))
    centre = (points.min(axis=0) + points.max(axis=0)) / 2.0
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    return {"centre": centre.tolist(), "radius": max(radius, 0.05)}


def _drawables(
    drawing: Drawing, layer: Layer, index: dict[str, int], floors: frozenset[str], surfaces: _Surfaces
) -> list[Json]:
    """One drawable for each colour of each frame."""
    parts: dict[tuple[str, Rgba], list[Surface]] = {}
    for shape in drawing.layer(layer):
        if shape.frame not in floors and len(shape.surface.faces):
            parts.setdefault((shape.frame, shape.rgba), []).append(shape.surface)
    found = []
    for (frame, rgba), each in parts.items():
        drawable: Json = {"surface": surfaces.number(joined(each)), "frame": index[frame]}
        drawable |= {"rgba": [round(c, 4) for c in rgba]}
        found.append(drawable | _robot(frame))
    return found


def _robot(frame: str) -> Json:
    return {"robot": True} if frame.startswith("robot/") else {}


class _Surfaces:
    """Distinct surfaces."""

    def __init__(self, pack: Pack) -> None:
        self.found: list[Json] = []
        self._pack = pack
        self._known: dict[bytes, int] = {}

    def number(self, surface: Surface) -> int:
        key = surface.vertices.tobytes() + surface.faces.tobytes()
        if key not in self._known:
            self._known[key] = len(self.found)
            self.found.append(_packed(surface, self._pack))
        return self._known[key]


def _packed(surface: Surface, pack: Pack) -> Json:
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


def _inertias(robot: RobotModel | None, scene: Scene | None, index: dict[str, int]) -> list[Json]:
    """Mass, centre of mass and box of equal inertia of each link and movable body."""
    inertials = {} if robot is None else {link_frame(link.name): link.inertial for link in robot.links}
    for body in scene.bodies if scene is not None else ():
        inertials[body.name] = None if body.fixed else Inertial(body.mass, body.X_OI, body.inertia)
    found: list[Json] = []
    for frame, inertial in inertials.items():
        if inertial is not None and inertial.mass > 0.0 and np.isfinite(inertial.inertia).all():
            box, X = inertia_box(inertial)
            found.append({"frame": index[frame], "mass": inertial.mass, "box": box.size, **_pose(X)} | _robot(frame))
    return found
