"""Messages of a camera, as ROS 2 has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, cast

import numpy as np
import numpy.typing as npt

from manipcli.render.lens import Depth, Lens
from manipcli.simulate.sensor import Picture

IMAGE, DEPTH, SEGMENTATION, LABELS, POINTS, CAMERA_INFO = (
    "/image_raw", "/depth", "/segmentation", "/labels", "/points", "/camera_info",
)  # fmt: skip
"""Suffixes of the topics."""
MILLIMETRES: Final = 1000.0
_FLOAT32: Final = 7
"""PointField.FLOAT32."""


def _picture(suffix: str, encoding: str, pixels: npt.NDArray[np.generic]) -> Picture:
    height, width = pixels.shape[:2]
    fields = {"height": height, "width": width, "encoding": encoding, "is_bigendian": 0}
    return Picture(suffix, {**fields, "step": pixels.nbytes // height, "data": pixels.tobytes()})


def image(colour: npt.NDArray[np.uint8]) -> Picture:
    """Colours (h, w, 3) as rgb8."""
    return _picture(IMAGE, "rgb8", colour)


def depth(metres: npt.NDArray[np.float32]) -> Picture:
    """Depth (h, w) [m] as 16UC1 in mm (REP 118); 0 where it is NaN, or beyond 65.535 m."""
    millimetres = np.rint(metres * np.float32(MILLIMETRES))
    with np.errstate(invalid="ignore"):
        known = millimetres <= 65535.0
    return _picture(DEPTH, "16UC1", np.where(known, millimetres, 0.0).astype("<u2"))


def metres(picture: Picture) -> npt.NDArray[np.float64]:
    """(h, w) depth [m] of a message of `depth`; NaN where it has none."""
    millimetres = np.frombuffer(cast(bytes, picture.fields["data"]), dtype="<u2").astype(np.float64)
    height, width = cast(int, picture.fields["height"]), cast(int, picture.fields["width"])
    return np.where(millimetres > 0.0, millimetres / MILLIMETRES, np.nan).reshape(height, width)


def segmentation(part: npt.NDArray[np.uint16], count: int) -> Picture:
    """Indices of parts (h, w), of `count`: 8UC1, or 16UC1 if there are more than 256."""
    if count <= 256:
        return _picture(SEGMENTATION, "8UC1", part.astype(np.uint8))
    return _picture(SEGMENTATION, "16UC1", part.astype("<u2"))


def labels(parts: Sequence[str]) -> Picture:
    """Names of the parts; 0 is the background."""
    classes = [{"class_id": k, "class_name": name} for k, name in enumerate(parts)]
    return Picture(LABELS, {"class_map": classes, "threshold": 0.0})


def points(cloud: Depth, colour: npt.NDArray[np.uint8] | None) -> Picture:
    """Points (h, w, 3) [m] in the rows of the picture, NaN where nothing is measured, with their colours."""
    height, width = cloud.shape[:2]
    names = ("x", "y", "z") if colour is None else ("x", "y", "z", "rgb")
    data = np.empty((height, width, len(names)), dtype="<f4")
    data[..., :3] = cloud
    if colour is not None:
        r, g, b = (colour[..., k].astype(np.uint32) for k in range(3))
        data[..., 3] = (r << 16 | g << 8 | b).view(np.float32)
    fields = [{"name": name, "offset": 4 * k, "datatype": _FLOAT32, "count": 1} for k, name in enumerate(names)]
    size = {"height": height, "width": width, "point_step": 4 * len(names), "row_step": 4 * len(names) * width}
    return Picture(POINTS, {**size, "fields": fields, "is_bigendian": False, "data": data.tobytes(), "is_dense": False})


def camera_info(lens: Lens) -> Picture:
    """The pinhole, without distortion."""
    K = [lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0]
    P = [lens.fx, 0.0, lens.cx, 0.0, 0.0, lens.fy, lens.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    fields = {
        "height": lens.height,
        "width": lens.width,
        "distortion_model": "plumb_bob",
        "d": np.zeros(5),
        "k": np.array(K),
        "r": np.eye(3).reshape(-1),
        "p": np.array(P),
    }
    return Picture(CAMERA_INFO, fields)
