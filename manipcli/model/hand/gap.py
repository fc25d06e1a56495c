"""The gap between the fingers of a hand, and the direction in which they close."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.hand.closure import SLAB, Closure, HandShape

INSIDE: Final = 0.012
"""[m] The middle of a gap is so far inside the finger tips."""
PAST: Final = 0.005
"""[m] It is at most so far beyond the tip of the shorter finger."""


class Gap(NamedTuple):
    """[m] Width between the fingers; `p` (3,) the middle of their tips; how far out the tips are, and `p` may be."""

    width: float
    p: Array
    far: float
    room: float = 0.0


def closing_axis(shape: HandShape, closure: Closure) -> Array:
    """(3,) in the palm's frame, not normalised: the direction in which the tips move most when the hand closes.

    Displacements along `closure.out` have no effect. Tips that close from all sides have no such direction; the
    result is then that of the first finger.
    """
    moved = []
    for finger in closure.fingers:
        step = shape.tip(finger, closure.closed) - shape.tip(finger, closure.opened)
        moved.append(step - (step @ closure.out) * closure.out)
    d = np.array(moved)
    if shape.hand.fixed or len(d) == 1:
        return np.asarray(d[0])
    values, vectors = np.linalg.eigh(d.T @ d)
    return np.asarray(d[0] if values[-2] > 0.9 * values[-1] else vectors[:, -1])


def gap_between(shape: HandShape, closure: Closure, positions: Array, R: Array) -> Gap:
    """The gap of the fingers along y of the axes R (3, 3) in the palm, with the joints of the hand at `positions` (m).

    The fingers are on two sides of the middle of the open hand. The gap is between the innermost points of both sides
    within the length of a tip from the end of the shorter side; below zero where fingers pass each other.
    """
    sides: tuple[list[Array], list[Array]] = ([], [])
    sets = [shape.points(links, positions) @ R for links in closure.fingers]
    if shape.hand.fixed:
        sets.append(shape.points(shape.hand.fixed, positions) @ R)
    opened = [shape.points(links, closure.opened) @ R for links in closure.fingers]
    if shape.hand.fixed:
        opened.append(shape.points(shape.hand.fixed, closure.opened) @ R)
    tops = [points[points[:, 2] >= points[:, 2].max() - SLAB] for points in opened]
    middles = np.array([top[:, 1].mean() for top in tops])
    centre = (middles.max() + middles.min()) / 2.0
    for points, middle in zip(sets, middles, strict=True):
        sides[int(middle > centre)].append(points)
    if not sides[0] or not sides[1]:
        every = np.vstack(sets)
        top = every[every[:, 2] >= every[:, 2].max() - SLAB]
        far = float(every[:, 2].max())
        return Gap(0.0, np.array([*top[:, :2].mean(axis=0), far - INSIDE]), far)
    low, high = (np.vstack(side) for side in sides)
    short, long = sorted((float(low[:, 2].max()), float(high[:, 2].max())))
    low, high = (side[side[:, 2] >= short - SLAB] for side in (low, high))
    inner = float(low[:, 1].max()), float(high[:, 1].min())
    x = (float(low[:, 0].mean()) + float(high[:, 0].mean())) / 2.0
    z = min(long - INSIDE, short + PAST)
    return Gap(inner[1] - inner[0], np.array([x, (inner[0] + inner[1]) / 2.0, z]), long, short + PAST - z)
