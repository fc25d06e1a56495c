"""Whether a peg is as deep in its hole as planned, in the measured world."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.units import readable
from manipcli.plan.motion import Insertion, PlanningState
from manipcli.plan.planner import Planner

SHORT: Final = 1e-3
"""[m] A peg that is less deep than planned by more than this is not inserted."""
BESIDE: Final = 2e-3
"""[m] A peg further from the believed axis than the search, the clearance and this went down beside the hole."""


@dataclass(frozen=True, slots=True)
class Found:
    """Where the end of a peg is.

    Attributes:
        depth: [m] below the rim.
        away: [m] from the believed axis of the hole.
    """

    depth: float
    away: float


def measured(planner: Planner, inserted: Insertion, now: PlanningState) -> Found:
    """The end of the peg in the frame of the believed hole."""
    peg, hole = planner.scene.body(inserted.peg), planner.scene.body(inserted.hole)
    assert hole.interior is not None  # refused by `check`
    tip = np.array([peg.centre[0], peg.centre[1], peg.centre[2] - peg.size[2] / 2.0])
    X_SW = (planner.body_pose(now, hole.name) @ hole.interior.X_OS).inverse()
    x, y, z = X_SW.apply(planner.body_pose(now, peg.name).apply(tip))
    return Found(hole.interior.rim - float(z), math.hypot(x, y))


def not_inserted(planner: Planner, inserted: Insertion | None, now: PlanningState) -> str:
    """Why the peg of a step is not in its hole; "" where it is, or where the step has none."""
    if inserted is None:
        return ""
    found = measured(planner, inserted, now)
    if found.away > inserted.radius + inserted.clearance + BESIDE:
        where = f"{readable(found.away, 'm')} from where '{inserted.hole}' is believed to be"
        return f"'{inserted.peg}' is not in '{inserted.hole}': it is {where}"
    if found.depth >= inserted.depth - SHORT:
        return ""
    wanted = f"expected {readable(inserted.depth, 'm')} within {readable(SHORT, 'm')}"
    deep = f"{max(0.0, 1000.0 * found.depth):.1f} mm deep" if found.depth > 0.0 else "above the rim"
    stuck = "; it jammed: press harder, `force: ...`" if found.depth > 2.0 * SHORT else ""
    return f"'{inserted.peg}' is {deep} in '{inserted.hole}', {wanted}{stuck}"


def insertion_text(planner: Planner, inserted: Insertion, now: PlanningState) -> str:
    """`'peg' is 40.0 mm deep in 'socket', found 2.9 mm from where it was expected; clearance 0.25 mm`."""
    found, clearance = measured(planner, inserted, now), 1000.0 * inserted.clearance
    off = f"{1000.0 * found.away:.1f} mm from where it was believed to be"
    deep = f"{1000.0 * found.depth:.1f} mm deep"
    return f"'{inserted.peg}' is {deep} in '{inserted.hole}', {off}; clearance {clearance:.2g} mm to each side"
