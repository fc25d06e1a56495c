"""What a container holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.model.collision import Pair
from manipcli.plan.flight import room
from manipcli.scene.scene import Body, Interior, Scene

Touching = Callable[[str], Set[Pair]]
"""The pairs of a movable body with what it touches."""


def contents_of(
    scene: Scene, container: Body, X_WC: Transform, bodies: Sequence[Transform], touching: Touching
) -> tuple[str, ...]:
    """The movable bodies whose centre lies in the interior of a container, and what is heaped on it or on them.

    Args:
        scene: the scene.
        container: a body, at X_WC.
        bodies: X_WO of the movable bodies.
        touching: see `Touching`.
    """
    interior = container.interior
    if interior is None:
        return ()
    X_SW = (X_WC @ interior.X_OS).inverse()
    places = {
        body.name: X_SW @ X_WO @ Transform.of(xyz=body.centre)
        for body, X_WO in zip(scene.movable, bodies, strict=True)
        if body.name != container.name
    }
    found = {name for name, X_SP in places.items() if interior.contains(X_SP.p)}
    above = {name for name, X in places.items() if name not in found and _heaped(interior, scene.body(name), X)}
    while on := {name for name in above if _touches(touching(name), name, {container.name, *found})}:
        found |= on
        above -= on
    return tuple(name for name in places if name in found)


def _heaped(interior: Interior, body: Body, X_SP: Transform) -> bool:
    """Whether a body is above the interior, by no more than its own size."""
    high = float(X_SP.p[2]) - interior.rim
    return 0.0 <= high <= float(np.max(body.size)) and room(interior, X_SP.p) > 0.0


def _touches(pairs: Set[Pair], name: str, others: Set[str]) -> bool:
    """Whether a body touches one of the others."""
    return any(name in pair and not others.isdisjoint(pair) for pair in pairs)
