"""Grasp frames of a handle: poses of the tool at which the hand closes on a bar, a ridge or a knob.

A handle is the box of a part. The tool comes against the normal of one of its faces and closes across it, never across
its longest edge. Faces that look away from the link come first. Then follow the faces beside them, where one finger is
between handle and link: it pulls by its shape, not by friction.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.plan.grasp_frames import GraspFrame

LONG: Final = 1.5
"""A box whose longest edge is longer than the second by this factor is a bar."""
TILTS_DEG: Final = (0.0, 30.0, -30.0, 50.0, -50.0)
"""Candidate rotations of the approach about the longest edge."""
ALONG: Final = (0.0, 0.25, -0.25)
"""Candidate places of the tool along the longest edge, in shares of it."""
INWARDS: Final = -0.5
"""Cosine to the outward direction below which a face looks at the link."""


def handle_frames(X_WP: Transform, size: Array, outward: Array, R_WT: Array) -> Iterator[GraspFrame]:
    """The frames, the preferred first.

    Args:
        X_WP: where the part is.
        size: (3,) [m] of the part; zero for a point.
        outward: (3,) unit vector in the world from the link to the handle.
        R_WT: (3, 3) present orientation of the tool; of two frames half a turn apart, the nearer is first.
    """
    order = np.argsort(size, kind="stable")
    bar = size[order[2]] > LONG * size[order[1]]
    edges = [X_WP.R[:, k] for k in range(3)]
    spots = ALONG if bar else ALONG[:1]
    long = int(order[2])
    faces = [(k, sign) for k in range(3) if not (bar and k == long) for sign in (1.0, -1.0)]
    faces.sort(key=lambda face: -round(float(face[1] * edges[face[0]] @ outward), 3))
    faces = [face for face in faces if face[1] * edges[face[0]] @ outward > INWARDS]
    for tilt, spot in ((tilt, spot) for tilt in TILTS_DEG for spot in spots):
        for k, sign in faces:
            across = [j for j in range(3) if j != k and not (bar and j == long)]
            for j in sorted(across, key=lambda j: float(size[j])):
                other = edges[3 - j - k]
                turn = matrix_from_axis_angle(other, math.radians(tilt))
                z, y = -(turn @ (sign * edges[k])), turn @ edges[j]
                p = X_WP.p + spot * size[long] * edges[long]
                yield from _both(p, z, y, R_WT, _name(tilt, spot, float(sign * edges[k] @ outward)))


def _both(p: Array, z: Array, y: Array, R_WT: Array, name: str) -> Iterator[GraspFrame]:
    """The two frames with these axes, that differ by half a turn about z."""
    both = [np.column_stack([np.cross(side, z), side, z]) for side in (y, -y)]
    for R in sorted(both, key=lambda R: -float(np.sum(R * R_WT))):
        yield GraspFrame(Transform.of(xyz=p, R=R), 0.0, name)


def _name(tilt: float, spot: float, facing: float) -> str:
    side = "from the front" if facing > 0.7 else "from its side"
    turned = f", tilted {tilt:g} deg" if tilt else ""
    return f"{side}{turned}{f', {100.0 * spot:+.0f} % along it' if spot else ''}"
