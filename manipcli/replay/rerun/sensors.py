"""Sensors in a Rerun recording.

/world/.../<camera>                      a camera in the frame of its link or body, with its lens
/world/.../<camera>/<stream>             its pictures, depths (points in 3D), labels or points
/world/.../<range finder>                the points that its rays meet
/sensors/<taxels>                        forces of a grid [N], row by row
/sensors/<sensor>/<quantity>/<axis>      curves
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import rotate
from manipcli.replay.pixels import PictureFile, Pixels
from manipcli.replay.rerun.bodies import frame_path
from manipcli.replay.rerun.measured import Cloud, Measured, Measurement, Mount, distances
from manipcli.replay.rerun.timelines import Timelines
from manipcli.replay.sensed import UNKNOWN, RayFeed, TaxelFeed

if TYPE_CHECKING:
    import rerun as rr

PLANE = 0.15
"""Distance of the picture from its camera in 3D [m]."""
QUALITY = 90
"""Of JPEG, 0 to 100, for pictures that are not compressed in the log."""
FILL = 0.4
"""Size of the points of a depth picture; 1: they touch, and hide what was measured."""
RAY_COLOUR = (230, 70, 70)


@dataclass(slots=True)
class Views:
    """The entities that get a view of their own: `pictures` with the camera that they belong to, and `tensors`."""

    pictures: dict[str, str] = field(default_factory=dict)
    tensors: list[str] = field(default_factory=list)


def log_sensors(to: rr.RecordingStream, measured: Measured, lines: Timelines) -> Views:
    """Everything except the curves."""
    found = Views()
    for feed in measured.taxels:
        found.tensors.append(_log_taxels(to, feed, lines))
    for rays in measured.rays:
        _log_rays(to, rays, lines)
    _log_pictures(to, measured.pictures, lines, found)
    return found


def _log_pictures(to: rr.RecordingStream, pictures: Iterable[Measurement], lines: Timelines, found: Views) -> None:
    import rerun as rr

    cameras: set[str] = set()
    for shot in pictures:
        camera = _camera_path(shot.camera, shot.mount)
        if camera not in cameras:
            cameras.add(camera)
            _log_camera(to, camera, shot)
        path = f"{camera}/{rr.escape_entity_path_part(shot.stream)}"
        lines.set(to, shot.time)
        to.log(path, _content(shot.content))
        if not isinstance(shot.content, Cloud):
            found.pictures.setdefault(path, camera)
    to.reset_time()


def _camera_path(name: str, mount: Mount | None) -> str:
    import rerun as rr

    root = "/sensors" if mount is None else frame_path(mount.parent)
    return "/".join([root, *map(rr.escape_entity_path_part, name.split("/"))])


def _log_camera(to: rr.RecordingStream, path: str, shot: Measurement) -> None:
    import rerun as rr

    if shot.mount is not None:
        X = shot.mount.X_PS
        to.log(path, rr.Transform3D(translation=X.p, quaternion=X.quat_xyzw), static=True)
    if shot.lens is not None:
        lens = shot.lens
        # A pixel's centre is at (0, 0) in CameraInfo, at (0.5, 0.5) here.
        pinhole = rr.Pinhole(
            focal_length=[lens.fx, lens.fy],
            principal_point=[lens.cx + 0.5, lens.cy + 0.5],
            width=lens.width,
            height=lens.height,
            image_plane_distance=PLANE,
        )
        to.log(path, pinhole, static=True)


def _content(content: Pixels | PictureFile | Cloud) -> rr.AsComponents:
    import rerun as rr

    match content:
        case Cloud():
            return rr.Points3D(content.points, colors=content.colours, radii=rr.Radius.ui_points(1.5))
        case PictureFile(kind="depth"):
            return rr.EncodedDepthImage(
                content.data, media_type=content.media_type, meter=1000.0, point_fill_ratio=FILL
            )
        case PictureFile():
            return rr.EncodedImage(contents=content.data, media_type=content.media_type)
        case Pixels(kind="labels"):
            return rr.SegmentationImage(content.rows.astype(np.uint16))
        case Pixels(kind="depth"):
            return _depth(content)
        case _:
            return rr.Image(content.rows).compress(jpeg_quality=QUALITY)


def _depth(content: Pixels) -> rr.DepthImage:
    """Depths in their own unit; 0 is not measured, for Rerun as for ROS."""
    import rerun as rr

    whole = content.rows.dtype.kind == "u"
    with np.errstate(invalid="ignore"):  # signalling NaN
        rows = content.rows.astype(np.float32)
    known = np.where(np.isfinite(rows), np.maximum(rows, 0.0), 0.0)
    depth = known.astype(np.uint16) if whole else known
    return rr.DepthImage(depth, meter=round(1.0 / content.unit), point_fill_ratio=FILL)


def _log_taxels(to: rr.RecordingStream, feed: TaxelFeed, lines: Timelines) -> str:
    import rerun as rr

    path = f"/sensors/{rr.escape_entity_path_part(feed.name)}"
    forces = np.where(feed.counts == UNKNOWN, np.nan, feed.counts * feed.unit).astype(np.float32)
    most = float(np.nanmax(forces, initial=0.0)) or 1.0
    for time, row in zip(feed.times.tolist(), forces, strict=True):
        lines.set(to, time)
        grid = row.reshape(feed.rows, feed.columns)
        to.log(path, rr.Tensor(grid, dim_names=("row", "column"), value_range=(0.0, most)))
    to.reset_time()
    return path


def _log_rays(to: rr.RecordingStream, feed: RayFeed, lines: Timelines) -> None:
    import rerun as rr

    path = f"{frame_path(feed.parent)}/{rr.escape_entity_path_part(feed.name)}"
    reach = distances(feed, UNKNOWN)
    along = np.stack([np.cos(feed.angles), np.sin(feed.angles), np.zeros_like(feed.angles)], axis=1)
    known = np.isfinite(reach)
    points = feed.X_PS.p + rotate(feed.X_PS.quat_xyzw, (reach[..., None] * along)[known])
    columns = rr.Points3D.columns(positions=points).partition(known.sum(axis=1))
    to.send_columns(path, lines.columns(feed.times), columns)
    style = rr.Points3D.from_fields(colors=[RAY_COLOUR], radii=[rr.Radius.ui_points(2.0)])
    to.log(path, style, static=True)
