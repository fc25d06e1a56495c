"""Search for a configuration that maximises a score, by coordinate ascent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel

FIRST: Final = 0.25
"""First step, as a share of the range of a joint."""
LAST: Final = 0.004
"""Smallest step, as a share of the range of a joint."""


def climbed(
    robot: RobotModel, score: Callable[[Array], Array], known: Array, low: Array, high: Array, *, starts: int = 1
) -> Array:
    """The configuration (n) with the largest score found.

    Coordinate ascent from the best known configurations: the joint step that raises the score most is taken; if none
    does, the step is halved.

    Args:
        robot: the robot of the configurations.
        score: configurations (T, n) -> scores (T,).
        known: (T, n) configurations.
        low, high: (n) limits of the joints.
        starts: number of known configurations to start from.
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
