"""How a hand closes and where its tool frame is, measured without names: both from its shapes and joint limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.collision import CollisionChecker
from manipcli.model.hand.closure import STEPS, Closure, HandShape, guess_closure, knuckles_only
from manipcli.model.hand.tool_frame import ToolFrame, guess_tool_frame
from manipcli.model.kinematics import Kinematics
from manipcli.scene.scene import Scene

BLOCK: Final = 0.04
"""[m] Edge of the block that a hand is asked to pick."""
OVERLAP: Final = 1e-3
"""[m] Fingers that close stop before they overlap by more."""
OVERLAP_PALM: Final = 5e-3
"""[m] The same with the palm, whose hull is larger than it is."""
PALM: Final = -1


def measure_hand(shape: HandShape, ends: tuple[Array, Array] | None = None) -> tuple[Closure, ToolFrame]:
    """How a hand closes, and its tool frame for a block.

    A hand with several joints in a finger is measured with all of them closing, and with the first ones alone; the
    better tool frame counts: its fingers hold the block, and it is farther out.

    Args:
        shape: of the hand.
        ends: (m), (m) the hand open and closed, if they are known.
    """
    guessed = guess_closure(shape)
    if ends is not None:
        opened, closed = ends
        options: list[Closure | None] = [
            replace(guessed, opened=opened, closed=closed, evidence="states of the SRDF: ")
        ]
    else:
        options = [guessed, knuckles_only(shape, guessed)]
    found = []
    for option in filter(None, options):
        stopped = replace(option, closed=_before_overlap(shape, option))
        found.append((stopped, guess_tool_frame(shape, stopped, width=BLOCK)))
    return max(found, key=lambda pair: (pair[1].narrowest < BLOCK, float(pair[1].X_PT.p @ pair[1].X_PT.R[:, 2])))


def _before_overlap(shape: HandShape, closure: Closure) -> Array:
    """(m) The closed hand, or where it stops because its fingers would overlap each other or the palm."""
    finger_of = {link: k for k, links in enumerate(closure.fingers) for link in links}
    part_of = dict.fromkeys((shape.hand.palm, *shape.hand.fixed), PALM) | finger_of
    query = CollisionChecker(Kinematics(shape.robot), Scene((), (), np.array([0.0, 0.0, -9.81]))).at()

    def overlapping(q: Array) -> set[frozenset[str]]:
        found = set()
        for hit in query.every(q):
            a, b = hit.a.removeprefix("robot/"), hit.b.removeprefix("robot/")
            parts = {part_of.get(a), part_of.get(b)}
            if len(parts) == 2 and None not in parts and hit.distance < -(OVERLAP_PALM if PALM in parts else OVERLAP):
                found.add(frozenset((a, b)))
        return found

    at_first = overlapping(shape.whole(closure.opened))
    last = closure.opened
    for share in np.linspace(0.0, 1.0, STEPS + 1):
        here = (1.0 - share) * closure.opened + share * closure.closed
        if overlapping(shape.whole(here)) - at_first:
            return last if share > 0.2 else closure.closed
        last = here
    return closure.closed
