"""Least distance between the parts that a collision query checks, over many configurations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.collision import CollisionHit, CollisionQuery, Pair


def least_distance(
    query: CollisionQuery, configurations: Array, of: Callable[[Pair], bool] = lambda _: True
) -> tuple[int, CollisionHit] | None:
    """The nearest pair `of` parts over all configurations (k, n), and in which; None if no such pair is checked.

    Exact at each configuration. Most distances are not computed: between two of them, a shape of radius r about its
    centre c moves by at most |dc| + r |dR|, so that a pair whose last distance exceeds the least one so far by more
    than both have moved since cannot be nearer.
    """
    import pinocchio as pin

    geometry, names = query.shapes
    chosen = [k for k, pair in enumerate(geometry.collisionPairs) if of((names[pair.first], names[pair.second]))]
    pairs = np.array([(pair.first, pair.second) for pair in geometry.collisionPairs], dtype=np.int64)[chosen]
    if not len(pairs):
        return None
    model = query.kinematics.model
    data, state = model.createData(), geometry.createData()
    objects = list(geometry.geometryObjects)
    for each in objects:
        each.geometry.computeLocalAABB()
    centres = np.array([np.array(each.geometry.aabb_center) for each in objects])
    radii = np.array([float(each.geometry.aabb_radius) for each in objects])
    moved = np.zeros(len(objects))  # path length of each shape so far
    known = np.full(len(pairs), -np.inf)  # last distance of each pair, and the path lengths then
    known_at = np.zeros(len(pairs))
    before: tuple[Array, Array] | None = None
    best, where, nearest = np.inf, 0, 0
    for k, q in enumerate(configurations):
        pin.forwardKinematics(model, data, q)
        pin.updateGeometryPlacements(model, data, geometry, state)
        R = np.array([X.rotation for X in state.oMg])
        p = np.array([X.translation for X in state.oMg]) + np.einsum("kij,kj->ki", R, centres)
        if before is not None:
            turned = np.linalg.norm((R - before[0]).reshape(len(R), 9), axis=1)
            moved += np.linalg.norm(p - before[1], axis=1) + radii * turned
        before = (R, p)
        together = moved[pairs[:, 0]] + moved[pairs[:, 1]]
        bound = known - (together - known_at)
        spheres = np.linalg.norm(p[pairs[:, 0]] - p[pairs[:, 1]], axis=1) - radii[pairs[:, 0]] - radii[pairs[:, 1]]
        bound = np.maximum(bound, spheres)
        for number in np.argsort(bound, kind="stable").tolist():
            if bound[number] >= best:
                break
            found = float(pin.computeDistance(geometry, state, chosen[number]).min_distance)
            known[number], known_at[number] = found, together[number]
            if found < best:
                best, where, nearest = found, k, number
    a, b = sorted(names[index] for index in pairs[nearest])
    return where, CollisionHit(a, b, best)
