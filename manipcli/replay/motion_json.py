"""The motion of a page: the states between which it interpolates, as JSON and arrays in its pack."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.render.placing import Placing
from manipcli.replay.ghost import Ghost
from manipcli.replay.level_of_detail import Rows, interpolated, needed_rows, pose_errors
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback

ROUTE = 1e-3
"""Largest distance of the line of the whole tool path from the sampled points [m]."""
MOST = 3000
"""Most points of that line, which is drawn in every picture."""


def motion_json(playback: Playback, ghosts: Sequence[Ghost], pack: Pack) -> Json:
    """States of the run, its references and its ghosts at the times that interpolation needs; gaps; tool path."""
    body = np.concatenate([playback.body_position, playback.body_quat_xyzw], axis=2)
    shown = {"position": (playback.stance, body)}
    if playback.has_reference:
        shown["reference"] = (playback.reference_position(), body)
    others = [(ghost.position, ghost.body) for ghost in ghosts]
    rows = _rows(playback, [*shown.values(), *others])
    times, path = playback.times, playback.tool_path()
    return {
        "times": pack.add(times[rows], "f"),
        "step": float(np.median(np.diff(times))) if len(times) > 1 else 0.0,
        "gaps": playback.gaps,
        "position": pack.add(playback.stance[rows], "f"),
        "reference": pack.add(shown["reference"][0][rows], "f") if "reference" in shown else None,
        "body": pack.add(body[rows], "f"),
        "path": pack.add(path[rows], "f") if len(rows) > 1 and len(path) else None,
        "route": pack.add(path[_route(path, rows)], "f") if len(rows) > 1 and len(path) else None,
        "ghosts": [
            {
                "name": one.name,
                "kind": one.kind,
                "visible": one.visible,
                "position": pack.add(one.position[rows], "f"),
                "body": pack.add(one.body[rows], "f"),
            }
            for one in ghosts
        ],
    }


def _route(path: Array, rows: Rows) -> Rows:
    """Of these rows of the tool path those of a line that is within `ROUTE`, or a multiple if it has more than `MOST`
    points; the time at a point does not matter."""
    points = path[rows]
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    bound = ROUTE
    while True:

        def errors(kept: Rows, others: Rows) -> Array:
            apart = interpolated(length, points, kept, others) - points[others]
            # Called at once, in the same turn of the loop.
            return np.asarray(np.linalg.norm(apart, axis=1) / bound)  # noqa: B023

        found = needed_rows(len(points), errors)
        if len(found) <= MOST:
            return rows[found]
        bound *= 2.0


def _rows(playback: Playback, states: Sequence[tuple[Array, Array]]) -> Rows:
    """Rows that are needed so that each of these motions is shown within the bounds of `level_of_detail`."""
    placing, times = Placing(playback.robot, playback.scene), playback.times
    each = [pose_errors(placing, times, joints, body) for joints, body in states]
    always = [playback.index(end) for gap in playback.gaps for end in gap]
    return needed_rows(
        len(times), lambda kept, rows: np.max([errors(kept, rows) for errors in each], axis=0), always=always
    )
