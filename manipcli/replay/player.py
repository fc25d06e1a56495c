"""HTML player of a run: one self-contained file that needs no server.

`player_html` is an element of a larger page, `player_page` a whole page. The browser gets the triangles once and the
joint positions at every time, and computes the kinematics itself.
"""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import WORLD, Drawing, draw, floors_of, ground_height, link_frame
from manipcli.render.placing import Poses
from manipcli.render.surface import Surface
from manipcli.replay.camera import framing
from manipcli.replay.forces import LONGEST, Forces
from manipcli.replay.ghost import Ghost
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback
from manipcli.replay.sensed_json import sensed_json
from manipcli.replay.theme import colours, switch
from manipcli.scene.scene import Scene

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
"""Content-Security-Policy of a whole page: it loads nothing."""
_PAGE = files("manipcli.replay").joinpath("page")


def player_html(playback: Playback, *, ghosts: Sequence[Ghost] = (), whole_page: bool = False) -> str:
    """A run as an HTML element with its own style and script; a page can hold several.

    Args:
        playback: the run.
        ghosts: other runs of the same task, drawn over it.
        whole_page: the element is alone on its page and takes the keyboard.
    """
    head, data, senses = _contents(playback, ghosts)
    script = "".join(map(_read, sorted(file.name for file in _PAGE.iterdir() if file.name.endswith(".js"))))
    style = _read("player.css")
    if senses:
        script, style = script + _read("sensors/sensors.js"), style + _read("sensors/sensors.css")
    return (
        f'<div class="mc-player"{" data-page=1" if whole_page else ""}>\n'
        f"<style>\n{style}</style>\n"
        f"{_read('player.html')}"
        f'<script type="application/json" data-part="head">{head}</script>\n'
        f'<script type="text/plain" data-part="data">{data}</script>\n'
        f"<script>(function () {{\n{script}}})();</script>\n</div>\n"
    )


def player_page(playback: Playback, *, ghosts: Sequence[Ghost] = ()) -> str:
    """A whole page: task, verdict, notes and player; `ghosts` are drawn over the run."""
    verdict = playback.verdict
    name = html.escape(playback.name)
    lines = []
    if verdict is not None:
        good = verdict.verdict == "passed"
        word = f"{'✓' if good else '✗'} {verdict.verdict}"
        lines.append(f'<p><b class="{"good" if good else "bad"}">{word}</b> {html.escape(verdict.text)}</p>')
    if playback.lost is not None:
        lines.append(f'<p class="bad">The log is incomplete: {html.escape(playback.lost)}</p>')
    lines += [f'<p class="note">{html.escape(note)}</p>' for note in playback.notes]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<title>{name}</title><link rel="icon" href="data:,">\n'
        f"<style>\n{colours()}{_read('whole_page.css')}"
        f"</style></head><body>\n{switch()}<header><h1>{name}</h1>{''.join(lines)}</header>\n"
        f"{player_html(playback, ghosts=ghosts, whole_page=True)}</body></html>\n"
    )


def _read(name: str) -> str:
    return _PAGE.joinpath(name).read_text("utf-8")


def _contents(playback: Playback, ghosts: Sequence[Ghost]) -> tuple[str, str, bool]:
    """Input of the script: the head as JSON that is safe in a script element, the packed arrays, and whether there is
    anything of sensors."""
    pack = Pack()
    drawing = draw(playback.robot, playback.scene)
    poses = playback.poses()
    frames, order = _frames(drawing, playback.robot, playback.scene)
    floors = floors_of(playback.scene)
    index = {name: k for k, name in enumerate(drawing.frames)}
    start = Poses(poses.position[0], poses.quat_xyzw[0])
    camera = framing(drawing, start, leave_out=floors).further(1.2)
    surfaces, drawables = _drawables(drawing, index, floors, pack)
    path = playback.tool_path()
    head: Json = {
        "name": playback.name,
        "start": playback.start,
        "end": playback.end,
        "steps": [asdict(step) for step in playback.steps],
        "skipped": _skipped(playback),
        "camera": {"eye": camera.eye, "target": camera.target, "field": camera.field},
        "ground": ground_height(drawing, start, floors),
        "frames": frames,
        "order": order,
        "axes": _axes(drawing, index, floors),
        "joints": playback.joint_names,
        "bodies": playback.body_position.shape[1],
        "surfaces": surfaces,
        "drawables": drawables,
        "times": pack.add(playback.times, "f"),
        "position": pack.add(playback.stance, "f"),
        "reference": pack.add(playback.reference_position(), "f") if playback.has_reference else None,
        "body": pack.add(np.concatenate([playback.body_position, playback.body_quat_xyzw], axis=2), "f"),
        "path": pack.add(path, "f") if len(path) > 1 else None,
        "pushes": _pushes(playback, poses, pack),
        "curves": [
            {"name": table.name, "columns": table.columns, "units": table.units, "values": pack.add(table.values, "f")}
            for table in playback.curves()
        ],
    }
    if ghosts:
        head["ghosts"] = [
            {"name": ghost.name, "position": pack.add(ghost.position, "f"), "body": pack.add(ghost.body, "f")}
            for ghost in ghosts
        ]
    sensed = playback.sensed(drawing.frames)
    if sensed:
        head["senses"] = sensed_json(sensed, index, pack)
    text = json.dumps(head, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    # These three occur only in JSON strings; a name must not end the script element.
    safe = text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
    return safe, pack.text(), bool(sensed)


def _skipped(playback: Playback) -> list[Json]:
    """The skipped steps, each with the number of steps that are listed before it."""
    index = {step.id: k for k, step in enumerate(playback.steps, 1)}
    found: list[Json] = []
    after = 0
    for step in playback.verdict.steps if playback.verdict is not None else ():
        after = index.get(step.id, after)
        if step.outcome == "skipped":
            found.append({"id": step.id, "label": step.label, "text": step.text, "after": after})
    return found


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
