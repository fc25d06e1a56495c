"""Measurements of sensors as input of the page: JSON, and arrays in its pack."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from manipcli.replay.pack import Json, Pack
from manipcli.replay.sensed import PictureStream, RayFeed, Sensed, TaxelFeed


def sensed_json(sensed: Sensed, index: Mapping[str, int], pack: Pack) -> Json:
    """The measurements; `index`: number of each frame of the drawing."""
    return {
        "cameras": [
            {"name": camera.name, "streams": [_stream(stream, pack) for stream in camera.streams]}
            for camera in sensed.cameras
        ],
        "taxels": [_taxels(feed, pack) for feed in sensed.taxels],
        "rays": [_rays(feed, index, pack) for feed in sensed.rays],
        "notes": sensed.notes,
    }


def _stream(stream: PictureStream, pack: Pack) -> Json:
    found: Json = {
        "name": stream.name,
        "kind": stream.kind,
        "size": stream.size,
        "note": stream.note,
        "times": pack.add(stream.times, "f"),
        "first": pack.add(np.cumsum([0, *map(len, stream.pictures)]), "I"),
        "bytes": pack.add(np.frombuffer(b"".join(stream.pictures), np.int8), "b"),
    }
    if stream.kind == "depth":
        found |= {"low": pack.add(stream.low, "f"), "high": pack.add(stream.high, "f")}
    return found


def _taxels(feed: TaxelFeed, pack: Pack) -> Json:
    return {
        "name": feed.name,
        "note": feed.note,
        "rows": feed.rows,
        "columns": feed.columns,
        "cell": feed.cell,
        "unit": feed.unit,
        "times": pack.add(feed.times, "f"),
        "counts": pack.add(feed.counts, "H"),
    }


def _rays(feed: RayFeed, index: Mapping[str, int], pack: Pack) -> Json:
    return {
        "name": feed.name,
        "note": feed.note,
        "frame": index[feed.parent],
        "p": feed.X_PS.p.tolist(),
        "q": feed.X_PS.quat_xyzw.tolist(),
        "angles": pack.add(feed.angles, "f"),
        "unit": feed.unit,
        "times": pack.add(feed.times, "f"),
        "taken": pack.add(feed.taken, "f"),
        "counts": pack.add(feed.counts, "H"),
    }
