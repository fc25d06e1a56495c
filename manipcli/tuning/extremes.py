"""Postures in which something is extreme: looked for uphill, from the best of some that are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel

FIRST: Final = 0.25
"""Of a joint's range: the first steps."""
LAST: Final = 0.004
"""Of a joint's range: no smaller ones."""


def climbed(
    robot: RobotModel, score: Callable[[Array], Array], known: Array, low: Array, high: Array, *, starts: int = 1
) -> Array:
    """The posture (n) of the largest score that is found.

    From each of the best known, one joint at a time is moved up or down, by whatever raises the score the most; where
    nothing does, by half as much.

    Args:
        robot: whose postures they are.
        score: of postures (T, n), (T,).
        known: (T, n) postures.
        low, high: (n) of the joints.
        starts: how many of the known it is tried from.
    """
    values = score(known)
    moves = np.vstack([np.diag(sign * (high - low)) for sign in (1.0, -1.0)])
    best, most = known[int(np.argmax(values))], float(values.max())
    for start in np.argsort(-values)[:starts]:
        here, there, size = known[start], float(values[start]), FIRST
        while size >= LAST:
            around = np.array([with_mimics(robot, q) for q in np.clip(here + size * moves, low, high)])
            found = score(around)
            k = int(np.argmax(found))
            if found[k] > there * (1.0 + 1e-9):
                here, there = around[k], float(found[k])
            else:
                size *= 0.5
        if there > most:
            best, most = here, there
    return np.asarray(best)
