"""Pairs of links that overlap with every joint at zero, or at its limit nearest to zero."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Joint
from manipcli.description.lint.rigid import box_about, moved_bodies
from manipcli.description.urdf.urdf import Parts
from manipcli.shapes.primitives import Geometry, Mesh
from manipcli.shapes.proximity import coal_shape, distance, overlap, surface

TOLERANCE: Final = 0.002
"""Overlap [m] up to which shapes only touch: descriptions are modelled without gaps."""
MOST_SHAPES: Final = 400
MOST_TRIANGLES: Final = 100_000
"""Larger meshes are skipped."""


@dataclass(frozen=True, slots=True)
class _Placed:
    """A collision shape in the frame of the root; `body`: number of its rigid group of links."""

    link: str
    body: int
    X_WS: Transform
    geometry: Geometry
    low: Array
    high: Array


def overlaps_at_zero(parts: Parts) -> Iterator[tuple[str, str, float]]:
    """Pairs of links without a joint between them, with the depth [m] of their overlap; each pair once.

    Meshes overlap only if both their hulls and their triangles do.
    """
    if not parts.root or parts.errors:
        return
    bodies = dict.fromkeys((link.name for link in parts.links), 0)
    for number, (_, links) in enumerate(moved_bodies(parts), start=1):
        bodies.update(dict.fromkeys(links, number))
    near = {frozenset((bodies[joint.parent], bodies[joint.child])) for joint in parts.joints}
    shapes = _placed(parts, bodies)
    if len(shapes) > MOST_SHAPES:
        return
    reported: set[frozenset[str]] = set()
    for i, a in enumerate(shapes):
        for b in shapes[i + 1 :]:
            pair = frozenset((a.link, b.link))
            if a.body == b.body or frozenset((a.body, b.body)) in near or pair in reported:
                continue
            if bool(np.any(np.minimum(a.high, b.high) - np.maximum(a.low, b.low) < TOLERANCE)):
                continue
            depth = _depth(a, b)
            if depth > TOLERANCE:
                reported.add(pair)
                yield a.link, b.link, depth


def _placed(parts: Parts, bodies: dict[str, int]) -> list[_Placed]:
    X_WL = {parts.root: Transform.identity()}
    for joint in parts.joints:
        X_WL[joint.child] = X_WL[joint.parent] @ joint.X_PJ @ _at_zero(joint)
    found = []
    for link in parts.links:
        for geometry in link.collisions:
            X_WS = X_WL[link.name] @ geometry.X_LS
            box = box_about([Geometry(X_LS=X_WS, shape=geometry.shape)])
            if box is not None:
                found.append(_Placed(link.name, bodies[link.name], X_WS, geometry, *box))
    return found


def _at_zero(joint: Joint) -> Transform:
    """Joint frame to child link at zero, or at the limit nearest to zero."""
    if not joint.independent:
        return Transform.identity()
    q = joint.limits.nearest(0.0)
    if q == 0.0:
        return Transform.identity()
    if joint.type == "prismatic":
        return Transform.of(xyz=joint.axis * q)
    return Transform.of(quat_xyzw=[*(joint.axis * np.sin(q / 2.0)), np.cos(q / 2.0)])


def _depth(a: _Placed, b: _Placed) -> float:
    """Depth of the overlap [m]; 0 if the shapes are apart."""
    try:
        shapes = [coal_shape(each.geometry.shape) for each in (a, b)]
    except ValueError:
        return 0.0
    depth = -distance(shapes[0], a.X_WS, shapes[1], b.X_WS).distance
    if depth <= TOLERANCE or not any(isinstance(each.geometry.shape, Mesh) for each in (a, b)):
        return max(0.0, depth)
    surface_a, surface_b = (surface(each.geometry.shape, most_triangles=MOST_TRIANGLES) for each in (a, b))
    if surface_a is None or surface_b is None:
        return 0.0
    return depth if overlap(surface_a, a.X_WS, surface_b, b.X_WS) else 0.0
