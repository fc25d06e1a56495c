"""A run as an animated glTF file: a node per link and body, one animation of the nodes that move."""

from __future__ import annotations

from collections import defaultdict
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, quat_product, rotate
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import WORLD, Drawable, draw, floors_of, link_frame
from manipcli.render.placing import Poses
from manipcli.replay.gltf.container import Document
from manipcli.replay.pack import Json
from manipcli.replay.playback import Playback

STEADY: Final = 1e-6
"""[m], or quaternion component: a node that moves less in its parent has no channel."""
UP: Final = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)
"""Rotation of the world: z is up in a run, y in a glTF file."""


def run_glb(playback: Playback) -> tuple[bytes, tuple[str, ...]]:
    """The file of a run, and what is not drawn, one line each.

    Nodes are named as links and bodies; a link is the child of its parent link. Times are seconds from the start of the
    playback. The floor is left out.
    """
    drawing = draw(playback.robot, playback.scene)
    floors = floors_of(playback.scene)
    shapes: dict[str, list[Drawable]] = defaultdict(list)
    for drawable in drawing.layer("visual"):
        if drawable.frame not in floors and len(drawable.surface.faces):
            shapes[drawable.frame].append(drawable)
    poses = playback.poses()
    index = {name: k for k, name in enumerate(drawing.frames) if name not in floors}
    parents = _parents(playback.robot)
    file = Document()
    numbers = {frame: number for number, frame in enumerate(index)}
    for frame in index:
        name = frame.removeprefix("robot/")
        node: Json = {"name": playback.name if frame == WORLD else name}
        children = [numbers[child] for child in index if child != WORLD and parents.get(child, WORLD) == frame]
        if children:
            node["children"] = children
        if frame in shapes:
            node["mesh"] = file.mesh(name, shapes[frame])
        file.nodes.append(node)
    file.nodes[0]["rotation"] = list(UP)
    _animate(file, playback, poses, index, parents)
    return file.glb(0), drawing.missing


def _parents(robot: RobotModel | None) -> dict[str, str]:
    """Frame of the parent link, by frame of a link with a parent."""
    joints = robot.joints if robot is not None else ()
    return {link_frame(joint.child): link_frame(joint.parent) for joint in joints}


def _animate(file: Document, playback: Playback, poses: Poses, index: dict[str, int], parents: dict[str, str]) -> None:
    """Places the nodes, and animates those that move."""
    times = np.asarray(playback.times - playback.start, dtype=np.float32)
    keys = np.flatnonzero(np.diff(times, prepend=-1.0) > 0.0)
    channels: list[Json] = []
    samplers: list[Json] = []
    clock: int | None = None
    for number, frame in enumerate(index):
        if frame == WORLD:
            continue
        p, q = _local(poses, index[frame], index[parents.get(frame, WORLD)])
        for path, values in (("translation", p), ("rotation", q)):
            values = values[keys]
            file.nodes[number][path] = values[0].tolist()
            if np.ptp(values, axis=0).max() < STEADY:
                continue
            if clock is None:
                clock = file.accessor(times[keys].astype(float), bounds=True)
            channels.append({"sampler": len(samplers), "target": {"node": number, "path": path}})
            samplers.append({"input": clock, "output": file.accessor(values), "interpolation": "LINEAR"})
    if channels:
        file.animations.append({"name": playback.name, "channels": channels, "samplers": samplers})


def _local(poses: Poses, k: int, parent: int) -> tuple[Array, Array]:
    """Positions (T, 3) and quaternions (T, 4) of a frame in another one; successive quaternions in one hemisphere."""
    back = poses.quat_xyzw[:, parent] * np.array([-1.0, -1.0, -1.0, 1.0])
    p = rotate(back, poses.position[:, k] - poses.position[:, parent])
    q = quat_product(back, poses.quat_xyzw[:, k])
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    signs = np.cumprod(np.where((q[1:] * q[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    return p, q * np.concatenate([[1.0], signs])[:, None]
