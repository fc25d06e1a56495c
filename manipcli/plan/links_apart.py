"""The hint for two links of the robot that are too near to each other."""

from __future__ import annotations

import math

from manipcli.model.collision import CollisionHit


def links_apart(hit: CollisionHit) -> str:
    """What helps: a smaller clearance where the links are apart; where they overlap, another model of them."""
    if hit.distance >= 0.0:
        least = f"{math.floor(10_000.0 * hit.distance) / 10.0:g} mm"
        return (
            f"set a pose with more room between them, or a smaller clearance, up to {least}: "
            f"`clearance: {{pairs: [{{between: [{hit.a}, {hit.b}], distance: ...}}]}}`"
        )
    return (
        "add the pair to `collision_ignore` in the robot file, if the real links are apart (a mesh counts as its "
        "convex hull, unless the link is under `collision_parts`); correct an attached hand with its `pose` under "
        "`attach`"
    )
