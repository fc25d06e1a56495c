"""Pairs of bodies of a scene that overlap at the start."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import Body
from manipcli.shapes.proximity import coal_shape, distance

if TYPE_CHECKING:
    from manipcli.shapes.proximity import CollisionGeometry

TOLERANCE = 1e-3
"""Overlap [m] up to which two bodies only touch: rounding, and what settling separates harmlessly."""


def overlaps(bodies: Sequence[Body], joints: Iterable[SceneJoint] = ()) -> Iterator[tuple[str, str, float]]:
    """Pairs of bodies, not both fixed nor joined, that overlap by more than `TOLERANCE`, with the depth [m].

    Bounding boxes rule out most pairs; the rest are compared shape by shape.
    """
    boxes = [_world_box(body) for body in bodies]
    joined = {frozenset((joint.parent, joint.child)) for joint in joints}
    made: dict[int, list[tuple[Transform, CollisionGeometry]]] = {}  # a mesh can have many convex parts
    for i, j in combinations(range(len(bodies)), 2):
        a, b = bodies[i], bodies[j]
        if (a.fixed and b.fixed) or (joined and frozenset((a.name, b.name)) in joined):
            continue
        (low_a, high_a), (low_b, high_b) = boxes[i], boxes[j]
        if bool(np.any(np.minimum(high_a, high_b) - np.maximum(low_a, low_b) < TOLERANCE)):
            continue
        for k in (i, j):
            if k not in made:
                made[k] = [(bodies[k].X_WO @ each.X_LS, coal_shape(each.shape)) for each in bodies[k].geometries]
        depth = max(
            (-distance(one, X_a, other, X_b).distance for X_a, one in made[i] for X_b, other in made[j]), default=0.0
        )
        if depth > TOLERANCE:
            yield a.name, b.name, depth


def _world_box(body: Body) -> tuple[Array, Array]:
    """Lowest and highest corner of the body's bounding box in the world."""
    centre = body.X_WO.apply(body.centre)
    half = np.abs(body.X_WO.R) @ (body.size / 2.0)
    return centre - half, centre + half
