"""Pairs of bodies of a scene that overlap at the start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Geometry
from manipcli.shapes.proximity import coal_shape, distance

TOLERANCE = 1e-3
"""Overlap [m] up to which two bodies only touch: rounding, and what settling separates harmlessly."""


def overlaps(bodies: Sequence[Body]) -> Iterator[tuple[str, str, float]]:
    """Pairs of bodies, not both fixed, that overlap by more than `TOLERANCE`, with the depth [m].

    Bounding boxes rule out most pairs; the rest are compared shape by shape.
    """
    boxes = [_world_box(body) for body in bodies]
    for i, j in combinations(range(len(bodies)), 2):
        a, b = bodies[i], bodies[j]
        if a.fixed and b.fixed:
            continue
        (low_a, high_a), (low_b, high_b) = boxes[i], boxes[j]
        if bool(np.any(np.minimum(high_a, high_b) - np.maximum(low_a, low_b) < TOLERANCE)):
            continue
        depth = max((_depth(a, ga, b, gb) for ga in a.geometries for gb in b.geometries), default=0.0)
        if depth > TOLERANCE:
            yield a.name, b.name, depth


def _world_box(body: Body) -> tuple[Array, Array]:
    """Lowest and highest corner of the body's bounding box in the world."""
    centre = body.X_WO.apply(body.centre)
    half = np.abs(body.X_WO.R) @ (body.size / 2.0)
    return centre - half, centre + half


def _depth(a: Body, shape_a: Geometry, b: Body, shape_b: Geometry) -> float:
    """Depth of the overlap [m]; 0 if the shapes are apart."""
    X_a, X_b = a.X_WO @ shape_a.X_LS, b.X_WO @ shape_b.X_LS
    return max(0.0, -distance(coal_shape(shape_a.shape), X_a, coal_shape(shape_b.shape), X_b).distance)
