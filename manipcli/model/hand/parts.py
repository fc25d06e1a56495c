"""The arm and the hand of a robot, from its kinematic tree and the sizes of its links.

Links without a joint that moves between them are one body. A *hand* is a body whose branches are short and have few
joints in series, at least two of them; or a single last joint beside which the link before it goes on: a jaw against a
fixed one. The *arm* is the chain of independent joints between the root and the hand, or the longest chain. Names do
not matter, except between frames at the same place.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.description.elements import Joint
from manipcli.model.configuration import zero_configuration
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel

DEEPEST: Final = 5
"""Most independent joints in series in a finger."""
LARGEST_HAND: Final = 0.4
"""[m] A hand reaches at most so far from its palm."""
HAND_TO_ARM: Final = 0.6
"""A hand longer than 0.25 m is shorter than this share of its arm."""
JAW: Final = 0.5
"""The fixed jaw is at least this share as long as the moving one."""
ASIDE: Final = 0.3
"""A jaw is to one side of its axis, by this share of its length at least; a wrist that rolls is not."""
HAND_BONUS: Final = 1.5
"""A chain with a hand counts as this many joints longer."""
_TOOLS: Final = ("tool", "tcp", "flange", "tip", "ee")


@dataclass(frozen=True, slots=True)
class Arm:
    """`joints`: independent joints from `base` to `tip` (links)."""

    joints: tuple[str, ...]
    base: str
    tip: str


@dataclass(frozen=True, slots=True)
class Hand:
    """A hand.

    Attributes:
        palm: the link at which the fingers branch off.
        joints: its independent joints.
        branches: links of each branch.
        fixed: links of the fixed jaw, for a hand with a single moving one.
    """

    palm: str
    joints: tuple[str, ...]
    branches: tuple[tuple[str, ...], ...]
    fixed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RobotParts:
    """What was found; `others`: independent joints of neither part, held by brakes."""

    arm: Arm | None
    hand: Hand | None
    arm_evidence: str
    hand_evidence: str
    others: tuple[str, ...]


def guess_parts(robot: RobotModel, points: ShapePoints, kinematics: Kinematics) -> RobotParts:
    """The arm and the hand."""
    tree = _Tree(robot, points, kinematics)
    found = sorted(tree.candidates(), key=lambda each: -each[0])
    arm, hand, arm_evidence, hand_evidence = found[0][1:] if found else (None, None, "", "")
    taken = {*(arm.joints if arm else ()), *(hand.joints if hand else ())}
    others = tuple(joint.name for joint in robot.joints if joint.independent and joint.name not in taken)
    return RobotParts(arm, hand, arm_evidence, hand_evidence, others)


def hand_at(robot: RobotModel, points: ShapePoints, kinematics: Kinematics, link: str | None = None) -> Hand | None:
    """The hand whose palm or one of whose fingers has this link; None: that of the longest chain, as in `guess_parts`.

    Of a chain of hands, the last one.
    """
    tree = _Tree(robot, points, kinematics)
    found = [hand for _, _, hand, *_ in sorted(tree.candidates(), key=lambda each: -each[0]) if hand is not None]
    if link is None:
        return found[0] if found else None
    below = {hand.palm: robot.descendants(tree.top(hand.palm)) for hand in found}
    around = [hand for hand in found if link in below[hand.palm]]
    return min(around, key=lambda hand: len(below[hand.palm]), default=None)


_Candidate = tuple[float, Arm | None, Hand | None, str, str]


class _Tree:
    def __init__(self, robot: RobotModel, points: ShapePoints, kinematics: Kinematics) -> None:
        self._robot, self._points, self._kinematics = robot, points, kinematics
        self._children: dict[str, list[Joint]] = {}
        self._above: dict[str, Joint] = {}
        for joint in robot.joints:
            self._children.setdefault(joint.parent, []).append(joint)
            self._above[joint.child] = joint
        self._zero = zero_configuration(robot)

    def candidates(self) -> Iterator[_Candidate]:
        """Every chain with its hand, if it has one, by a score."""
        hands: set[str] = set()
        for body in self._bodies():  # parents first
            chain = self._chain(body[0])
            if any(self.top(joint.parent) in hands for joint in chain):
                continue  # a part of a finger
            branches = self._branches(body)
            if branches:
                hand, why = self._as_hand(branches, chain)
                if hand is not None:
                    hands.add(body[0])
                    yield self._scored(chain, hand, hand.palm, why)
            elif chain:
                yield self._ending(body, chain)

    def _ending(self, body: tuple[str, ...], chain: tuple[Joint, ...]) -> _Candidate:
        """A chain that ends in this body, which is a jaw or the last link of an arm."""
        jaw, why = self._as_jaw(body, chain)
        if jaw is not None:
            return self._scored(chain[:-1], jaw, jaw.palm, why)
        return self._scored(chain, None, self._last_frame(body), "")

    def _scored(self, chain: tuple[Joint, ...], hand: Hand | None, tip: str, why: str) -> _Candidate:
        own = tuple(joint for joint in chain if joint.independent)
        if not own:
            return (0.5 if hand else 0.0), None, hand, "", why
        arm = Arm(tuple(joint.name for joint in own), own[0].parent, tip)
        evidence = f"the longest chain: {number_of(len(own), 'joint')} from '{arm.base}' to '{tip}'"
        return len(own) + HAND_BONUS * (hand is not None), arm, hand, evidence, why

    def _bodies(self) -> Iterator[tuple[str, ...]]:
        """Each rigid body as its links, the uppermost first."""
        for top in (self._robot.root, *(joint.child for joint in self._robot.joints if joint.moves)):
            yield self._body(top)

    def _body(self, top: str) -> tuple[str, ...]:
        links, k = [top], 0
        while k < len(links):
            links += [joint.child for joint in self._children.get(links[k], []) if not joint.moves]
            k += 1
        return tuple(links)

    def _branches(self, body: tuple[str, ...]) -> tuple[Joint, ...]:
        return tuple(joint for link in body for joint in self._children.get(link, []) if joint.moves)

    def _chain(self, link: str) -> tuple[Joint, ...]:
        """The joints that move, from the root to this link."""
        found: list[Joint] = []
        while link in self._above:
            joint = self._above[link]
            if joint.moves:
                found.append(joint)
            link = joint.parent
        return tuple(reversed(found))

    def _depth(self, joint: Joint) -> int:
        below = [self._depth(child) for child in self._children.get(joint.child, [])]
        return int(joint.independent) + max(below, default=0)

    def _reach(self, links: list[str], centre: Array) -> float:
        """[m] from a point to the farthest point or frame of these links."""
        frames = np.array([self._kinematics.forward(self._zero, link).p for link in links])
        every = np.vstack([frames, self._points.at(self._zero, links)])
        return float(np.linalg.norm(every - centre, axis=1).max())

    def _length(self, chain: tuple[Joint, ...]) -> float:
        """[m] of a chain: the sum of the distances between its joints."""
        places = [self._kinematics.forward(self._zero, joint.child).p for joint in chain]
        return float(sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(places)))

    def _as_hand(self, branches: tuple[Joint, ...], chain: tuple[Joint, ...]) -> tuple[Hand | None, str]:
        below = [sorted(self._robot.descendants(joint.child)) for joint in branches]
        joints = tuple(
            joint.name
            for joint in self._robot.joints
            if joint.independent and any(joint.child in links for links in below)
        )
        if len(branches) < 2 or not joints or max(map(self._depth, branches)) > DEEPEST:
            return None, ""
        centre = np.mean([self._kinematics.forward(self._zero, joint.child).p for joint in branches], axis=0)
        reach, length = self._reach([link for links in below for link in links], centre), self._length(chain)
        if reach > LARGEST_HAND or (chain and reach > 0.25 and reach > HAND_TO_ARM * length):
            return None, ""
        palm = branches[0].parent
        mimics = sum(joint.mimic is not None for joint in self._robot.joints if any(joint.child in b for b in below))
        follow = f" and {number_of(mimics, 'mimic joint')}" if mimics else ""
        why = (
            f"{len(branches)} branches at '{palm}', at most {readable(reach, 'm')} long: "
            f"{number_of(len(joints), 'independent joint')}{follow}"
        )
        return Hand(palm, joints, tuple(tuple(links) for links in below)), why

    def top(self, link: str) -> str:
        """The uppermost link of the rigid body of a link."""
        while link in self._above and not self._above[link].moves:
            link = self._above[link].parent
        return link

    def _as_jaw(self, body: tuple[str, ...], chain: tuple[Joint, ...]) -> tuple[Hand | None, str]:
        """The hand whose only moving finger is this body, at the end of an arm; None if it is not a jaw."""
        last = chain[-1]
        if len(chain) < 3 or last.type == "continuous" or not last.independent:
            return None, ""
        X_WJ = self._kinematics.forward(self._zero, last.child)
        axis, before = X_WJ.R @ last.axis, self._kinematics.forward(self._zero, chain[-2].child).p
        fixed = tuple(self._body(self.top(last.parent)))
        own = self._points.at(self._zero, body)
        frames = np.array([self._kinematics.forward(self._zero, link).p for link in fixed])
        beside = np.vstack([self._points.at(self._zero, fixed), frames])
        away = beside[int(np.argmax(np.linalg.norm(beside - before, axis=1)))] - before
        ahead = float(np.max((beside - X_WJ.p) @ away)) / max(1e-9, float(np.linalg.norm(away)))
        length = 0.04
        if len(own):
            flat = own - X_WJ.p
            flat = flat - np.outer(flat @ axis, axis)
            length = float(np.linalg.norm(flat, axis=1).max())
            if last.type == "revolute" and float(np.linalg.norm(flat.mean(axis=0))) < ASIDE * length:
                return None, ""
        if ahead < max(JAW * length, 0.02) or length > LARGEST_HAND:
            return None, ""
        why = (
            f"one moving jaw: '{fixed[0]}' goes on {readable(ahead, 'm')} beyond the joint '{last.name}', "
            f"beside '{body[0]}' ({readable(length, 'm')})"
        )
        return Hand(last.parent, (last.name,), (body,), fixed), why

    def _last_frame(self, body: tuple[str, ...]) -> str:
        """The link at the end of an arm: of the frames without a shape the farthest, else the body itself."""
        bare = [link for link in body[1:] if not len(self._points.of(link)) and link not in self._children]
        bare = bare or [link for link in body[1:] if not len(self._points.of(link))]
        if not bare:
            return body[-1] if len(body) == 2 else body[0]
        start = self._kinematics.forward(self._zero, body[0]).p

        def order(link: str) -> tuple[float, bool]:
            far = round(float(np.linalg.norm(self._kinematics.forward(self._zero, link).p - start)), 3)
            return far, any(word in link for word in _TOOLS)

        return max(bare, key=order)
