"""Robot and scene in a Rerun recording: meshes in the frames of links and bodies, and the poses of these over time.

/world/robot/<link>, /world/scene/<body>    poses in the world
    .../visual_0, ...                       meshes, fixed in them
/collision/..., /inertia/...                layers of their own, attached to the same frames: each is hidden by
                                            one switch
/world/marks/<name>                         tool and frames of the task, as axes
/world/tool_path                            where the tool goes
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from manipcli.render.drawing import WORLD, Drawable, Drawing
from manipcli.render.placing import Poses
from manipcli.replay.playback import Playback
from manipcli.replay.rerun.timelines import Timelines, changes

if TYPE_CHECKING:
    import rerun as rr

GRAIN = 1e-6
"""A pose that changes by less is not repeated [m; of a quaternion]."""
AXIS = 0.06
"""Length of the axes of a mark [m]."""
PATH_COLOUR = (240, 150, 30)
LAYERS = ("collision", "inertia")
"""Layers beside the visible one, hidden at first."""


def frame_path(frame: str, root: str = "/world") -> str:
    """The entity of a frame of the drawing: `/world/robot/link_1`, `/world/scene/cup`."""
    import rerun as rr

    if frame == WORLD:
        return root
    kind, name = ("robot", frame.removeprefix("robot/")) if frame.startswith("robot/") else ("scene", frame)
    return f"{root}/{kind}/{rr.escape_entity_path_part(name)}"


def log_bodies(
    to: rr.RecordingStream, playback: Playback, drawing: Drawing, poses: Poses, lines: Timelines, floors: frozenset[str]
) -> None:
    """Everything that has a shape; bodies `floors` are left out, as in the page: Rerun draws a grid."""
    import rerun as rr

    to.log("/world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for k, frame in enumerate(drawing.frames):
        if frame != WORLD:
            _log_poses(to, frame_path(frame), poses.position[:, k], poses.quat_xyzw[:, k], playback, lines)
    for shape in drawing.drawables:
        if shape.frame not in floors and len(shape.surface.faces):
            _log_shape(to, shape)
    for mark in drawing.marks:
        at = f"/world/marks/{rr.escape_entity_path_part(mark.name)}"
        to.log(at, rr.CoordinateFrame(f"mark {mark.name}"), rr.TransformAxes3D(AXIS), static=True)
        X = rr.Transform3D(
            translation=mark.X_FM.p,
            quaternion=mark.X_FM.quat_xyzw,
            parent_frame=_frame(mark.frame),
            child_frame=f"mark {mark.name}",
        )
        to.log(at, X, static=True)
    path = playback.tool_path()
    if len(path) > 1:
        to.log(
            "/world/tool_path", rr.LineStrips3D([path], radii=rr.Radius.ui_points(1.0), colors=PATH_COLOUR), static=True
        )


def _frame(frame: str) -> str:
    """The name of the coordinate frame that an entity has by its path."""
    return f"tf#{frame_path(frame)}"


def _log_poses(
    to: rr.RecordingStream, path: str, position: np.ndarray, quat: np.ndarray, playback: Playback, lines: Timelines
) -> None:
    import rerun as rr

    kept = changes(np.concatenate([position, quat], axis=1), GRAIN)
    if len(kept) == 1:
        to.log(path, rr.Transform3D(translation=position[0], quaternion=quat[0]), static=True)
        return
    columns = rr.Transform3D.columns(translation=position[kept], quaternion=quat[kept])
    to.send_columns(path, lines.columns(playback.times[kept]), columns)


def _log_shape(to: rr.RecordingStream, shape: Drawable) -> None:
    import rerun as rr

    root = "/world" if shape.layer == "visual" else f"/{shape.layer}"
    path = f"{frame_path(shape.frame, root)}/{shape.name.rpartition('/')[2]}"
    mesh = rr.Mesh3D(
        vertex_positions=shape.surface.vertices,
        triangle_indices=shape.surface.faces,
        vertex_normals=shape.surface.normals,
        albedo_factor=[round(255.0 * part) for part in shape.rgba],
    )
    to.log(path, mesh, static=True)
    if shape.layer != "visual":
        to.log(path, rr.CoordinateFrame(_frame(shape.frame)), static=True)
