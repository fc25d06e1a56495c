"""The arm, the hand, poses and touching links that an SRDF states, for a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean, listed, number_of
from manipcli.description.elements import Joint
from manipcli.description.srdf import Srdf, SrdfGroup
from manipcli.model.hand.closure import HandShape, tip_distance
from manipcli.model.hand.parts import Arm, Hand, RobotParts
from manipcli.model.robot import RobotModel

_STATED: Final = "stated in the SRDF"
LEAST_TRAVEL: Final = 5e-3
"""[m] by which the finger tips of an open hand are farther apart than those of a closed one."""


@dataclass(frozen=True, slots=True)
class StatedParts:
    """What an SRDF states about a robot.

    Attributes:
        parts: arm and hand; None where the file has no group of such joints.
        arm_name, hand_name: names of their groups.
        poses: positions by joint, by name of the state, then by group: of the arm and of the hand.
        touching: pairs of links that may touch; those of the file that the robot has.
        notes: for the user.
    """

    parts: RobotParts
    arm_name: str
    hand_name: str
    poses: Mapping[str, Mapping[str, Mapping[str, float]]]
    touching: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]

    def merged(self, guessed: RobotParts) -> RobotParts:
        """These parts; a hand that the file leaves out is the guessed one, if it is at the end of the arm."""
        own = self.parts
        if own.arm is None:
            return guessed
        if own.hand is not None or guessed.hand is None or {*guessed.hand.joints} & {*own.arm.joints}:
            return own
        others = tuple(name for name in own.others if name not in guessed.hand.joints)
        return replace(own, hand=guessed.hand, hand_evidence=guessed.hand_evidence, others=others)

    def arm_states(self, joints: tuple[str, ...]) -> dict[str, Array]:
        """(m) the states that set all joints of the arm, by name."""
        found = {}
        for name, groups in self.poses.items():
            positions = groups.get(self.arm_name, {})
            if set(joints) <= positions.keys():
                found[name] = np.array([positions[joint] for joint in joints])
        return found

    def ends(self, shape: HandShape) -> tuple[Array, Array] | None:
        """(m), (m) the states of the hand with the widest and the narrowest tips; None without two that differ."""
        joints = shape.hand.joints
        found = []
        for groups in self.poses.values():
            positions = groups.get(self.hand_name, {})
            if set(joints) <= positions.keys():
                q = np.array([positions[joint] for joint in joints])
                found.append((tip_distance(shape, shape.hand.branches, q), q))
        found.sort(key=lambda pair: pair[0])
        if len(found) < 2 or found[-1][0] - found[0][0] < LEAST_TRAVEL:
            return None
        return found[-1][1], found[0][1]


def stated_parts(robot: RobotModel, srdf: Srdf) -> StatedParts:
    """The parts of a robot as its SRDF states them.

    The hand is the group of an end effector, the arm its parent group; without one, the arm is the group with the most
    joints in series that lead to the end effector's parent link. Of several, those with the longest arm.

    Raises:
        InvalidInput: groups or states name links or joints that the robot does not have.
    """
    reader = _Reader(robot, srdf)
    hand_group, arm_group = reader.chosen()
    hand = reader.hand(hand_group) if hand_group is not None else None
    arm = reader.arm(arm_group, hand) if arm_group is not None else None
    poses = reader.poses({group.name for group in (arm_group, hand_group) if group is not None})
    if reader.findings:
        raise InvalidInput(reader.findings)
    taken = {*(arm.joints if arm else ()), *(hand.joints if hand else ())}
    others = tuple(joint.name for joint in robot.joints if joint.independent and joint.name not in taken)
    links = {link.name for link in robot.links}
    touching = tuple(pair for pair in srdf.touching if links.issuperset(pair))
    notes = []
    unknown = len(srdf.touching) - len(touching)
    if unknown:
        notes.append(f"{number_of(unknown, 'pair')} of `disable_collisions` are left out: the robot lacks their links")
    left = [group.name for group in srdf.groups if group not in (arm_group, hand_group)]
    if left:
        notes.append(f"groups of the SRDF that are not used: {listed(left)}")
    parts = RobotParts(arm, hand, _STATED if arm else "", _STATED if hand else "", others)
    return StatedParts(
        parts,
        arm_group.name if arm_group else "arm",
        hand_group.name if hand_group else "hand",
        poses,
        touching,
        tuple(notes),
    )


class _Reader:
    def __init__(self, robot: RobotModel, srdf: Srdf) -> None:
        self._robot, self._srdf = robot, srdf
        self._above = {joint.child: joint for joint in robot.joints}
        self.findings: list[Diagnostic] = []

    def chosen(self) -> tuple[SrdfGroup | None, SrdfGroup | None]:
        """The groups of the hand and of the arm: of all end effectors, those with the longest arm."""
        srdf, found = self._srdf, []
        for effector in srdf.end_effectors:
            hand, stated = srdf.group(effector.group), srdf.group(effector.parent_group)
            if hand is not None and self._joints(hand):
                arm = stated if self._in_series(self._joints(stated)) else self._longest(hand, effector.parent_link)
                found.append((len(self._joints(arm)), hand, arm))
        if not found:
            return None, self._longest()
        _, hand, arm = max(found, key=lambda each: each[0])
        return hand, arm

    def _longest(self, without: SrdfGroup | None = None, above: str | None = None) -> SrdfGroup | None:
        """The group with the most joints in series; with `above`, of those that lead to this link."""
        own = set(self._joints(without))
        leading = None if above is None else {joint.name for joint in self._chain(above)}
        serial = []
        for group in self._srdf.groups:
            joints = self._joints(group)
            reaches = leading is None or leading.issuperset(joints)
            if reaches and not own & set(joints) and self._in_series(joints):
                serial.append((len(joints), group))
        return max(serial, key=lambda pair: pair[0])[1] if serial else None

    def _in_series(self, joints: tuple[str, ...]) -> bool:
        if not joints:
            return False
        chain = self._chain(self._robot.joint(joints[-1]).child)
        return set(joints) <= {joint.name for joint in chain}

    def _chain(self, link: str) -> list[Joint]:
        """The joints from the root to a link."""
        found = []
        while link in self._above:
            found.append(self._above[link])
            link = self._above[link].parent
        return found[::-1]

    def _joints(self, group: SrdfGroup | None, within: frozenset[str] = frozenset()) -> tuple[str, ...]:
        """Independent joints of a group in the order of the robot; unknown names are findings.

        `within`: the groups that contain it, which it cannot contain again.
        """
        if group is None:
            return ()
        found: set[str] = set()
        for name in group.joints:
            if name in self._srdf.virtual or self._known(name, self._joint_names, "joint", group.place):
                found.add(name)
        for name in group.links:
            if self._known(name, self._link_names, "link", group.place) and name in self._above:
                found.add(self._above[name].name)
        if group.chain is not None:
            base, tip = group.chain
            if all(self._known(name, self._link_names, "link", group.place) for name in (base, tip)):
                found |= {joint.name for joint in self._between(base, tip, group)}
        within |= {group.name}
        for name in group.groups:
            if name not in within:
                found |= set(self._joints(self._srdf.group(name), within))
        return tuple(joint.name for joint in self._robot.joints if joint.independent and joint.name in found)

    @property
    def _joint_names(self) -> list[str]:
        return [joint.name for joint in self._robot.joints]

    @property
    def _link_names(self) -> list[str]:
        return [link.name for link in self._robot.links]

    def _between(self, base: str, tip: str, group: SrdfGroup) -> list[Joint]:
        found = self._chain(tip)
        for k, joint in enumerate(found):
            if joint.parent == base:
                return found[k:]
        if base != tip:
            message = f"group '{group.name}': link '{base}' is not above link '{tip}'"
            self._report(Diagnostic("SRDF006", message, group.place))
        return []

    def _known(self, name: str, names: list[str], kind: str, place: Place | None) -> bool:
        if name in names:
            return True
        hint = did_you_mean(name, names, kind=f"{kind}s")
        self._report(Diagnostic("SRDF005", f"{kind} '{name}' is not in the robot", place, hint))
        return False

    def _report(self, finding: Diagnostic) -> None:
        if finding not in self.findings:
            self.findings.append(finding)

    def arm(self, group: SrdfGroup, hand: Hand | None) -> Arm | None:
        """The arm of a group; its tip is the palm, the tip of the chain, or the last link."""
        joints = self._joints(group)
        if not joints:
            return None
        last = self._robot.joint(joints[-1])
        tip = group.chain[1] if group.chain is not None else last.child
        if hand is not None and last.child in {joint.child for joint in self._chain(hand.palm)}:
            tip = hand.palm
        return Arm(joints, self._robot.joint(joints[0]).parent, tip)

    def hand(self, group: SrdfGroup) -> Hand | None:
        """The hand of a group: branches below its first joints, and mimic joints beside them."""
        joints = self._joints(group)
        if not joints:
            return None
        own = {self._robot.joint(name).child for name in joints}
        first = [
            self._robot.joint(name)
            for name in joints
            if not own & {joint.child for joint in self._chain(self._robot.joint(name).parent)}
        ]
        palm = first[0].parent
        body = self._body(palm)
        roots = [joint for joint in self._robot.joints if joint.moves and joint.parent in body]
        roots = [joint for joint in roots if joint in first or joint.mimic is not None]
        branches = tuple(tuple(sorted(self._robot.descendants(joint.child))) for joint in roots)
        return Hand(palm, joints, branches, body if len(branches) == 1 else ())

    def _body(self, link: str) -> tuple[str, ...]:
        """The links fixed to each other around this one."""
        top = link
        while top in self._above and not self._above[top].moves:
            top = self._above[top].parent
        found = [top]
        for joint in self._robot.joints:
            if not joint.moves and joint.parent in found:
                found.append(joint.child)
        return tuple(found)

    def poses(self, groups: set[str]) -> dict[str, dict[str, dict[str, float]]]:
        """States of these groups."""
        found: dict[str, dict[str, dict[str, float]]] = {}
        for state in self._srdf.states:
            if state.group not in groups:
                continue
            members = self._joints(self._srdf.group(state.group))
            for name in state.positions:
                if name not in self._srdf.virtual:
                    self._known(name, self._joint_names, "joint", state.place)
            positions = {name: value for name, value in state.positions.items() if name in members}
            if positions:
                found.setdefault(state.name, {})[state.group] = positions
        return found
