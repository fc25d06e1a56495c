"""Which ends of a hand's joints open it, and where it is closed: measured between its finger tips."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.model.configuration import with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.onboard.parts import Hand
from manipcli.onboard.shape_points import ShapePoints

SLAB: Final = 0.02
"""[m] Length of a finger that counts as its tip."""
FINGER: Final = 0.6
"""Branches that reach at least this share of the farthest one are fingers; shorter ones are links of a linkage."""
WEAK: Final = 0.15
"""Joints that change the distance of the tips by less than this share of the best one stay where they are."""
UNLIMITED: Final = 1.0
"""[rad or m] assumed for the range of a joint without limits, to each side."""
STEPS: Final = 40


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """How a hand closes.

    Attributes:
        opened, closed: (m) positions of the hand's joints, in their order.
        out: (3,) unit vector in the palm's frame, from the palm to the finger tips.
        fingers: links of each finger, those of a linkage left out.
        evidence: why.
    """

    opened: Array
    closed: Array
    out: Array
    fingers: tuple[tuple[str, ...], ...]
    evidence: str


class HandShape:
    """Finger tips of a hand in the frame of its palm P."""

    def __init__(self, hand: Hand, kinematics: Kinematics, points: ShapePoints, q: Array) -> None:
        """
        Args:
            hand: the hand.
            kinematics, points: of the robot.
            q: (n) all joints; those of the hand are replaced.
        """
        self.hand, self._kinematics, self._points, self._q = hand, kinematics, points, q
        self.robot = kinematics.robot
        self._columns = self.robot.indices(hand.joints)

    def whole(self, fingers: Array) -> Array:
        """(n) all joints with the hand's at `fingers` (m)."""
        q = np.array(self._q)
        q[self._columns] = fingers
        return with_mimics(self.robot, q)

    def points(self, links: tuple[str, ...], fingers: Array) -> Array:
        """(k, 3) points of links in P; the frames of links where there are no shapes at all."""
        q = self.whole(fingers)
        X_PW = self._kinematics.forward(q, self.hand.palm).inverse()
        found = self._points.at(q, links, X_PW)
        if len(found):
            return found
        return np.array([(X_PW @ self._kinematics.forward(q, link)).p for link in links])

    def ranges(self) -> tuple[Array, Array]:
        """(m), (m) ends of the joints' ranges."""
        ends = [self.robot.joint(name).limits.within_soft for name in self.hand.joints]
        lower, upper = np.array(ends).T
        return np.where(np.isfinite(lower), lower, -UNLIMITED), np.where(np.isfinite(upper), upper, UNLIMITED)

    def palm_centre(self) -> Array:
        """(3,) in P: the mean of the joints at which the branches begin, where they leave the palm."""
        q = self._q
        X_PW = self._kinematics.forward(q, self.hand.palm).inverse()
        first = [joint.child for joint in self.robot.joints if joint.moves and joint.parent == self.hand.palm]
        first = first or [branch[0] for branch in self.hand.branches]
        return np.mean([(X_PW @ self._kinematics.forward(q, link)).p for link in first], axis=0)


def tips_of(points: Array, out: Array) -> Array:
    """The points (k, 3) within `SLAB` of the farthest along `out`."""
    height = points @ out
    return points[height >= height.max() - SLAB]


def guess_closure(shape: HandShape) -> Closure:
    """The open and the closed end of a hand."""
    lower, upper = shape.ranges()
    middle = (lower + upper) / 2.0
    out = _outward(shape, middle)
    fingers = _fingers(shape, middle, out)

    def spread(positions: Array) -> float:
        return _spread(shape, fingers, positions, out)

    effects = np.zeros(len(middle))
    for k in range(len(middle)):
        for sign, end in ((1.0, upper[k]), (-1.0, lower[k])):
            there = np.array(middle)
            there[k] = end
            effects[k] += sign * spread(there)
    most = float(np.abs(effects).max(initial=0.0))
    idle = np.abs(effects) < WEAK * most
    rest = np.clip(0.0, lower, upper)
    opened = np.where(idle, rest, np.where(effects > 0.0, upper, lower))
    closed = np.where(idle, rest, np.where(effects > 0.0, lower, upper))
    wide, narrow = spread(opened), spread(closed)
    evidence = f"the finger tips are {readable(wide, 'm')} apart when open, {readable(narrow, 'm')} when closed"
    return Closure(opened, closed, out, fingers, evidence)


def _outward(shape: HandShape, middle: Array) -> Array:
    """(3,) the direction in P in which the fingers point."""
    every = np.vstack([shape.points(branch, middle) for branch in shape.hand.branches])
    centre = shape.palm_centre()
    if shape.hand.fixed:
        centre = np.zeros(3)
    out = every.mean(axis=0) - centre
    far = every[np.argsort(-(every @ out))[: max(1, len(every) // 4)]].mean(axis=0) - centre
    return np.asarray(far / max(1e-9, float(np.linalg.norm(far))))


def _fingers(shape: HandShape, middle: Array, out: Array) -> tuple[tuple[str, ...], ...]:
    heights = [float((shape.points(branch, middle) @ out).max()) for branch in shape.hand.branches]
    base = float(shape.palm_centre() @ out)
    top = max(heights) - base
    return tuple(
        branch for branch, height in zip(shape.hand.branches, heights, strict=True) if height - base >= FINGER * top
    )


def _spread(shape: HandShape, fingers: tuple[tuple[str, ...], ...], positions: Array, out: Array) -> float:
    """[m] mean distance between finger tips across `out`; of one jaw, from the tip of the fixed one."""
    sets = [*fingers, *([shape.hand.fixed] if shape.hand.fixed else [])]
    tips = [tips_of(shape.points(links, positions), out).mean(axis=0) for links in sets]
    flat = [tip - (tip @ out) * out for tip in tips]
    apart = [float(np.linalg.norm(a - b)) for a, b in combinations(flat, 2)]
    return float(np.mean(apart)) if apart else 0.0


def palm_pose(shape: HandShape, fingers: Array) -> Transform:
    """X_WP at these positions of the hand."""
    return shape._kinematics.forward(shape.whole(fingers), shape.hand.palm)
