"""Which ends of a hand's joints open it, and where it is closed: measured between its finger tips."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.configuration import with_mimics
from manipcli.model.hand.parts import Hand
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.kinematics import Kinematics

SLAB: Final = 0.02
"""[m] Length of a finger that counts as its tip."""
FINGER: Final = 0.6
"""Branches that reach at least this share of the farthest one are fingers; shorter ones are links of a linkage."""
LONG: Final = 0.6
"""The same share of lengths, for fingers that point in another direction than the others."""
ALIKE: Final = 0.15
"""Share of the largest eigenvalue below which a direction is across all axes."""
PARALLEL: Final = 0.94
"""Least cosine between fingers that point in the same direction."""
WEAK: Final = 0.15
"""Joints that change the distance of the tips by less than this share of the best one stay where they are."""
UNLIMITED: Final = 1.0
"""[rad or m] assumed for the range of a joint without limits, to each side."""
STEPS: Final = 40
FACING: Final = 1.3
"""Fingers are spread only if their tips are then wider by this factor: they face each other."""
APART: Final = 0.01
"""[m] Fingers that begin nearer to each other than twice this are told apart by their tips."""
SPREADS: Final = 0.9
"""Least cosine between a joint's axis and the direction of the fingers for a joint that only spreads them."""


@dataclass(frozen=True, slots=True, eq=False)
class Closure:
    """How a hand closes.

    Attributes:
        opened, closed: (m) positions of the hand's joints, in their order.
        out: (3,) unit vector in the palm's frame, from the palm to the finger tips.
        fingers: links of each finger, those of a linkage left out.
        evidence: why.
        measured: on shapes; without any, which end opens the hand is only plausible.
    """

    opened: Array
    closed: Array
    out: Array
    fingers: tuple[tuple[str, ...], ...]
    evidence: str = ""
    measured: bool = True


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
        self._tips: dict[tuple[str, ...], tuple[str, Array]] = {}

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

    def tip(self, links: tuple[str, ...], fingers: Array) -> Array:
        """(3,) in P: the tip of a finger, the same material point wherever the finger is."""
        link, p_LT = self.tip_point(links)
        q = self.whole(fingers)
        X_PL = self._kinematics.forward(q, self.hand.palm).inverse() @ self._kinematics.forward(q, link)
        return np.asarray(X_PL.apply(p_LT))

    def tip_point(self, links: tuple[str, ...]) -> tuple[str, Array]:
        """The link of the tip of a finger, and (3,) the tip in this link."""
        if links not in self._tips:
            self._tips[links] = self._tip_of(links)
        return self._tips[links]

    def base(self, links: tuple[str, ...], fingers: Array) -> Array:
        """(3,) in P: the joint at which a finger begins."""
        first = next(joint.child for joint in self.robot.joints if joint.child in links and joint.moves)
        q = self.whole(fingers)
        return np.asarray(
            (self._kinematics.forward(q, self.hand.palm).inverse() @ self._kinematics.forward(q, first)).p
        )

    def last_axis(self, links: tuple[str, ...], fingers: Array) -> Array:
        """(3,) in P: the axis of the last joint of a finger that moves."""
        below = {joint.child for joint in self.robot.joints if joint.child in links and joint.moves}
        last = next(joint for joint in reversed(self.robot.joints) if joint.child in below)
        q = self.whole(fingers)
        X_PL = self._kinematics.forward(q, self.hand.palm).inverse() @ self._kinematics.forward(q, last.child)
        return np.asarray(X_PL.R @ last.axis)

    def _tip_of(self, links: tuple[str, ...]) -> tuple[str, Array]:
        """The link that reaches farthest from the base of its finger at rest, and (3,) its far end, in the link."""
        lower, upper = self.ranges()
        q = self.whole(np.clip(0.0, lower, upper))
        own = [joint for joint in self.robot.joints if joint.child in links and joint.moves]
        base = self._kinematics.forward(q, own[0].child).p if own else self._kinematics.forward(q, links[0]).p
        if not own:  # the fixed jaw
            base = self._kinematics.forward(q, self.hand.palm).p
        best, most = (links[0], np.zeros(3)), -1.0
        for link in links:
            X_WL = self._kinematics.forward(q, link)
            points = self._points.of(link) if len(self._points.of(link)) else np.zeros((1, 3))
            away = np.linalg.norm(X_WL.apply(points) - base, axis=1)
            if float(away.max()) > most:
                far = points[away >= away.max() - SLAB / 2]
                best, most = (link, far.mean(axis=0)), float(away.max())
        return best

    def ranges(self) -> tuple[Array, Array]:
        """(m), (m) ends of the joints' ranges."""
        ends = [self.robot.joint(name).limits.within_soft for name in self.hand.joints]
        lower, upper = np.array(ends).T
        return np.where(np.isfinite(lower), lower, -UNLIMITED), np.where(np.isfinite(upper), upper, UNLIMITED)

    def about(self, joint: str, fingers: Array, out: Array) -> bool:
        """Whether a joint rotates about the direction `out` (3,) in P."""
        found, q = self.robot.joint(joint), self.whole(fingers)
        X_PW = self._kinematics.forward(q, self.hand.palm).inverse()
        axis = (X_PW @ self._kinematics.forward(q, found.child)).R @ found.axis
        return found.unit == "rad" and abs(float(axis @ out)) > SPREADS

    def palm_centre(self) -> Array:
        """(3,) in P: the mean of the joints at which the branches begin, where they leave the palm."""
        q = self._q
        X_PW = self._kinematics.forward(q, self.hand.palm).inverse()
        first = [joint.child for joint in self.robot.joints if joint.moves and joint.parent == self.hand.palm]
        first = first or [branch[0] for branch in self.hand.branches]
        return np.asarray(np.mean([(X_PW @ self._kinematics.forward(q, link)).p for link in first], axis=0))


def guess_closure(shape: HandShape) -> Closure:
    """The open and the closed end of a hand.

    A joint closes at the end at which the finger tips are nearer to the line through the middle of the palm, seen from
    where the fingers begin: bent fingers may cross it. A joint that does not move the tips to or from that line closes
    at the end that is farther from zero, as the joints of a hand with fingers in a row do; if neither end is, or if it
    rotates about that line, it spreads the fingers, and stays.
    """
    lower, upper = shape.ranges()
    rest = np.clip(0.0, lower, upper)
    return _ends(shape, _facing(shape, rest, lower, upper), lower, upper)


def _ends(shape: HandShape, rest: Array, lower: Array, upper: Array) -> Closure:
    """The ends, with joints that spread the fingers at `rest` (m)."""
    middle = np.where(_spreads(shape, rest, rest), rest, (lower + upper) / 2.0)
    out = _outward(shape, shape.hand.branches, rest, middle)
    fingers = _fingers(shape, rest, out)
    inward = _inward(shape, fingers, out, middle)
    effects = np.zeros(len(rest))
    for k in range(len(rest)):
        for sign, end in ((1.0, upper[k]), (-1.0, lower[k])):
            there = np.array(rest)
            there[k] = end
            effects[k] += sign * sum(
                float(shape.tip(finger, there) @ direction) for finger, direction in zip(fingers, inward, strict=True)
            )
    about = np.array([shape.about(name, rest, out) for name in shape.hand.joints])
    weak = np.abs(effects) < WEAK * float(np.abs(np.where(about, 0.0, effects)).max(initial=0.0))
    lopsided = np.maximum(np.abs(upper), np.abs(lower)) > 2.0 * np.minimum(np.abs(upper), np.abs(lower))
    idle = about | (weak & ~lopsided)
    upwards = np.where(weak, np.abs(upper) > np.abs(lower), effects > 0.0)
    opened = np.where(idle, rest, np.where(upwards, lower, upper))
    closed = np.where(idle, rest, np.where(upwards, upper, lower))
    out = _outward(shape, fingers, opened, (opened + closed) / 2.0)
    return Closure(opened, closed, out, fingers)


def knuckles_only(shape: HandShape, closure: Closure) -> Closure | None:
    """The same hand closed by the first joint of each finger that closes it, the others open; None if that is the same.

    Fingers that bend at all their joints curl above a small object; those that bend at their knuckles pinch it.
    """
    robot, joints = shape.robot, shape.hand.joints
    closing = {name for name, a, b in zip(joints, closure.opened, closure.closed, strict=True) if a != b}
    below = {
        name
        for name in closing
        for other in closing - {name}
        if robot.joint(name).child in robot.descendants(robot.joint(other).child)
    }
    if not below:
        return None
    closed = np.where([name in below for name in joints], closure.opened, closure.closed)
    return replace(closure, closed=closed)


def _spreads(shape: HandShape, rest: Array, positions: Array) -> npt.NDArray[np.bool_]:
    """(m) Whether each joint rotates about the direction of the fingers."""
    out = _outward(shape, shape.hand.branches, rest)
    return np.array([shape.about(name, positions, out) for name in shape.hand.joints])


def _facing(shape: HandShape, rest: Array, lower: Array, upper: Array) -> Array:
    """(m) Rest, with the joints that spread the fingers where the tips are much farther apart, if that exists.

    Fingers that point to the same side at rest then face each other.
    """
    best = np.array(rest)
    most = tip_distance(shape, shape.hand.branches, best) * FACING
    for _ in range(2):
        for k in np.flatnonzero(_spreads(shape, rest, rest)):
            for value in (lower[k], (lower[k] + upper[k]) / 2.0, upper[k]):
                there = np.array(best)
                there[k] = value
                wide = tip_distance(shape, shape.hand.branches, there)
                if wide > most + 1e-3:
                    best, most = there, wide
    return best


def _inward(shape: HandShape, fingers: tuple[tuple[str, ...], ...], out: Array, middle: Array) -> list[Array]:
    """(3,) for each finger: unit vector across `out`, from where it begins (else its tip) to the others."""
    begins = [shape.base(finger, middle) for finger in fingers]
    flat = _across(begins, out)
    if min((float(np.linalg.norm(each)) for each in flat), default=0.0) < APART:
        ends = [*fingers, *([shape.hand.fixed] if shape.hand.fixed else [])]
        flat = _across([shape.tip(finger, middle) for finger in ends], out)[: len(fingers)]
    return [-each / max(1e-9, float(np.linalg.norm(each))) for each in flat]


def _across(places: list[Array], out: Array) -> list[Array]:
    """The places relative to their mean, across `out`."""
    away = np.array(places) - np.mean(places, axis=0)
    return list(away - np.outer(away @ out, out))


def _outward(shape: HandShape, fingers: tuple[tuple[str, ...], ...], *positions: Array) -> Array:
    """(3,) the direction in P from the palm to the finger tips, on average over these positions of the hand.

    It is across the axes of the last joint of each finger: fingers bend about these, or slide along them.
    """
    towards = np.sum([_pointing(shape, fingers, here) for here in positions], axis=0)
    axes = np.array([shape.last_axis(finger, positions[0]) for finger in fingers])
    values, vectors = np.linalg.eigh(axes.T @ axes)
    across = vectors[:, values < ALIKE * values[-1]]
    out = across @ (across.T @ towards) if across.shape[1] else towards
    return np.asarray(out / max(1e-9, float(np.linalg.norm(out))))


def _pointing(shape: HandShape, fingers: tuple[tuple[str, ...], ...], positions: Array) -> Array:
    """(3,) the mean of the directions from the base to the tip of the fingers; parallel fingers count once.

    Two fingers against one then point straight ahead.
    """
    ways = [shape.tip(finger, positions) - shape.base(finger, positions) for finger in fingers]
    if shape.hand.fixed:
        ways.append(shape.tip(shape.hand.fixed, positions))
    groups: list[list[Array]] = []
    for way in ways:
        length = max(1e-9, float(np.linalg.norm(way)))
        for group in groups:
            if float(group[0] @ way) > PARALLEL * float(np.linalg.norm(group[0])) * length:
                group.append(way)
                break
        else:
            groups.append([way])
    return np.asarray(np.sum([np.mean(group, axis=0) for group in groups], axis=0))


def _fingers(shape: HandShape, positions: Array, out: Array) -> tuple[tuple[str, ...], ...]:
    """The branches whose tips are far out, or far from where they begin."""
    tips = [shape.tip(branch, positions) for branch in shape.hand.branches]
    centre = shape.palm_centre()
    heights = [float((tip - centre) @ out) for tip in tips]
    ways = zip(tips, shape.hand.branches, strict=True)
    lengths = [float(np.linalg.norm(tip - shape.base(branch, positions))) for tip, branch in ways]
    found = [
        branch
        for branch, height, length in zip(shape.hand.branches, heights, lengths, strict=True)
        if height >= FINGER * max(heights) or length >= LONG * max(lengths)
    ]
    return tuple(found) or shape.hand.branches


def tip_distance(shape: HandShape, fingers: tuple[tuple[str, ...], ...], positions: Array) -> float:
    """[m] mean distance between finger tips; of one jaw, from the tip of the fixed one."""
    tips = [shape.tip(links, positions) for links in (*fingers, *([shape.hand.fixed] if shape.hand.fixed else []))]
    apart = [float(np.linalg.norm(a - b)) for a, b in combinations(tips, 2)]
    return float(np.mean(apart)) if apart else 0.0
