"""Walls around an axis as they are drawn: closed at their joints, and otherwise the boxes of the physics."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.render.mitred_walls import mitred_walls
from manipcli.render.surface import joined
from manipcli.scene.body_shapes import cup
from manipcli.shapes.primitives import Box, Cylinder, Geometry
from manipcli.spec.scene import CupSpec


@pytest.mark.parametrize("segments", [6, 12, 24])
def test_the_walls_of_a_cup_are_a_ring_without_gaps(segments: int) -> None:
    """Oracle: an n-sided ring has as its area twice its ends, n outer and n inner faces, in closed form; and no edge of
    a triangle is open but those of the missing sides, which lie on those of the neighbours."""
    spec = CupSpec(radius=0.036, height=0.11, wall=0.004, segments=segments)
    shapes = cup(spec, (1.0, 1.0, 1.0, 1.0)).geometries
    walls = mitred_walls(shapes)
    assert [type(shapes[k].shape) for k in walls] == [Box] * segments
    whole = joined([surface.moved(shapes[k].X_LS) for k, surface in walls.items()])
    a, b, c = (whole.vertices[whole.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0
    outer, inner, depth, t = 0.036, 0.032, 0.11 - 0.004, math.tan(math.pi / segments)
    expected = segments * (2.0 * outer * t * depth + 2.0 * inner * t * depth + 2.0 * (outer**2 - inner**2) * t)
    assert area == pytest.approx(expected, rel=1e-9)
    # Each edge of the joints belongs to two walls: every place is a corner of both.
    places, count = np.unique(np.round(whole.vertices, 9) + 0.0, axis=0, return_counts=True)
    assert len(places) == 4 * segments
    assert count.min() >= 4
    # Outside is outside: the outer faces look away from the axis, the inner ones towards it.
    middle, normal = (a + b + c) / 3.0, np.cross(b - a, c - a)
    out = np.einsum("ij,ij->i", middle[:, :2], normal[:, :2])
    radius = np.linalg.norm(middle[:, :2], axis=1)
    level = np.abs(normal[:, 2]) < 1e-12
    assert (np.sign(out[level]) == np.where(radius[level] > 0.034, 1.0, -1.0)).all()
    assert (np.sign(normal[~level, 2]) == np.where(middle[~level, 2] > 0.05, 1.0, -1.0)).all()


def test_other_boxes_stay_boxes() -> None:
    """Boxes that are not a whole ring: one missing, one higher turned, at the axis, two of them."""
    spec = CupSpec(radius=0.036, height=0.11, wall=0.004, segments=12)
    shapes = cup(spec, (1.0, 1.0, 1.0, 1.0)).geometries
    assert mitred_walls(shapes[:-1]) == {}
    turned = Geometry(shapes[-1].X_LS @ Transform.of(rpy=(0.1, 0.0, 0.0)), shapes[-1].shape)
    assert mitred_walls([*shapes[:-1], turned]) == {}
    alone = Geometry(Transform.identity(), Box((0.1, 0.1, 0.1)))
    assert mitred_walls([alone, Geometry(Transform.identity(), Cylinder(0.1, 0.1))]) == {}
