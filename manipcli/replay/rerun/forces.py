"""Contact forces in a Rerun recording: arrows at the contact points, and their sum with its number, pair by pair.

/world/contacts/<a>/<b>/sum       one arrow with the force [N] as its label
/world/contacts/<a>/<b>/points    normal force and friction at each contact point
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.forces import Forces, Push
from manipcli.replay.playback import Playback
from manipcli.replay.rerun.timelines import Timelines

if TYPE_CHECKING:
    import rerun as rr

NORMAL, FRICTION, SUM = (220, 60, 60), (90, 140, 230), (240, 150, 30)
RADIUS = 0.0015
"""Of the shaft of an arrow [m]."""
CONTACTS = "/world/contacts"


def log_forces(to: rr.RecordingStream, playback: Playback, forces: Forces, lines: Timelines) -> None:
    """The forces at every time at which a pair is in contact, and nothing once it is not."""
    import rerun as rr

    if not forces.scale:
        return
    found: dict[tuple[str, str], dict[int, tuple[Push, ...]]] = {}
    for k in range(len(playback.times)):
        for contact, pushes in forces.by_contact(k):
            found.setdefault((contact.a, contact.b), {})[k] = pushes
    to.log(CONTACTS, rr.AnyValues(metres_per_newton=[forces.scale]), static=True)
    for (a, b), at in found.items():
        # An empty row where the contact ends: Rerun holds the last row.
        rows = sorted(at.keys() | {k + 1 for k in at if k + 1 < len(playback.times)})
        index = lines.columns(playback.times[rows])
        path = "/".join([CONTACTS, *(rr.escape_entity_path_part(name.removeprefix("robot/")) for name in (a, b))])
        _log_sums(to, f"{path}/sum", index, [at.get(k, ()) for k in rows], forces.scale)
        _log_points(to, f"{path}/points", index, [at.get(k, ()) for k in rows], forces.scale)


def _log_sums(
    to: rr.RecordingStream, path: str, index: list[rr.TimeColumn], rows: Sequence[tuple[Push, ...]], scale: float
) -> None:
    import rerun as rr

    sums = [_sum(pushes) for pushes in rows if pushes]
    force = np.array([total for _, total in sums])
    columns = rr.Arrows3D.columns(
        origins=np.array([point for point, _ in sums]),
        vectors=force * scale,
        labels=[f"{np.linalg.norm(total):.2f} N" for total in force],
    )
    to.send_columns(path, index, columns.partition([1 if pushes else 0 for pushes in rows]))
    to.log(path, rr.Arrows3D.from_fields(colors=[SUM], radii=[2.0 * RADIUS], show_labels=True), static=True)


def _sum(pushes: tuple[Push, ...]) -> tuple[Array, Array]:
    """The point in the middle of the normal forces [m], and the sum of all forces [N]."""
    weights = np.array([float(np.linalg.norm(push.normal)) for push in pushes])
    point = np.average([push.point for push in pushes], axis=0, weights=weights)
    return point, np.sum([push.normal + push.friction for push in pushes], axis=0)


def _log_points(
    to: rr.RecordingStream, path: str, index: list[rr.TimeColumn], rows: Sequence[tuple[Push, ...]], scale: float
) -> None:
    import rerun as rr

    every = [push for pushes in rows for push in pushes]
    columns = rr.Arrows3D.columns(
        origins=np.repeat([push.point for push in every], 2, axis=0),
        vectors=scale * np.array([force for push in every for force in (push.normal, push.friction)]),
        colors=[NORMAL, FRICTION] * len(every),
    )
    to.send_columns(path, index, columns.partition([2 * len(pushes) for pushes in rows]))
    to.log(path, rr.Arrows3D.from_fields(radii=[RADIUS]), static=True)
