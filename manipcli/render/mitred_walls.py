"""Surfaces for walls of boxes around an axis, such as those of a cup, with mitred joints.

Physics gets boxes, which overlap inside and leave grooves outside. Drawn, their sides flicker along the joints; so each
box is drawn without its sides, and its other faces reach to the planes between it and its neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from manipcli.render.surface import Surface, smoothed
from manipcli.shapes.primitives import Box, Geometry

FEWEST = 3
_NEAR = 1e-6  # m and rad


def mitred_walls(geometries: Sequence[Geometry]) -> dict[int, Surface]:
    """The surface of each box of a ring, in the frame of the box, by the index of its geometry.

    A ring is n equal upright boxes at 0, 2 pi / n, ... about the z axis of their body; x of each box points outwards.
    """
    rings: dict[Box, list[tuple[int, float, float]]] = {}
    for k, geometry in enumerate(geometries):
        match geometry.shape:
            case Box() as box:
                X = geometry.X_LS
                radius, angle = math.hypot(X.p[0], X.p[1]), math.atan2(X.p[1], X.p[0])
                outward = np.array([math.cos(angle), math.sin(angle), 0.0])
                upright = np.allclose(X.R[:, 0], outward, atol=_NEAR) and np.allclose(X.R[:, 2], (0, 0, 1), atol=_NEAR)
                if upright and radius > box.size[0] / 2.0:
                    rings.setdefault(box, []).append((k, radius, angle % (2.0 * math.pi)))
    found: dict[int, Surface] = {}
    for box, ring in rings.items():
        n = len(ring)
        angles, radii = np.array([angle for *_, angle in ring]), np.array([radius for _, radius, _ in ring])
        steps = angles * n / (2.0 * math.pi)
        even = np.allclose(steps, np.round(steps), atol=_NEAR) and len(set(np.round(steps).astype(int) % n)) == n
        if n >= FEWEST and even and np.ptp(radii) < _NEAR:
            wall = _wall(box, float(radii[0]), n)
            found |= {k: wall for k, *_ in ring}
    return found


def _wall(box: Box, radius: float, n: int) -> Surface:
    """Inner, outer, lower and upper face, between the planes at +-pi / n about an axis at x = -radius."""
    x, z = box.size[0] / 2.0, box.size[2] / 2.0
    corners = np.array([(a * x, b * (radius + a * x) * math.tan(math.pi / n), c * z) for a, b, c in _SIGNS])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for side in sides for face in (side[:3], (side[0], *side[2:]))]
    return smoothed(corners, faces)


_SIGNS = [(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]
