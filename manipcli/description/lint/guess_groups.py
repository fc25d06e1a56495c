"""Guess of a robot's groups: chains of joints, and the hands at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from manipcli.description.elements import Joint

GroupKind = Literal["chain", "hand"]
DEEPEST_FINGER: Final = 4
"""Most moving joints in series in a finger."""


@dataclass(frozen=True, slots=True)
class GuessedGroup:
    """`joints`: independent joints; `mimics`: mimic joints; `base` and `tip`: links, tip '' for a hand."""

    kind: GroupKind
    joints: tuple[str, ...]
    mimics: tuple[str, ...]
    base: str
    tip: str


def guess_groups(root: str, joints: Sequence[Joint]) -> tuple[GuessedGroup, ...]:
    """The chains and hands of a tree.

    A chain extends until the moving joints branch. The branches are a hand if no finger has more than
    `DEEPEST_FINGER` joints in series and a chain leads there, or if the robot has nothing else; otherwise each
    branch is a chain. Mimic joints beside the only branch with independent joints are a linkage, not branches.

    Args:
        root: the root link.
        joints: parents before children.
    """
    tree = _Tree(joints)
    found: list[GuessedGroup] = []
    stems: list[tuple[str, Joint | None, bool]] = [(root, None, False)]
    while stems:
        base, first, after_chain = stems.pop()
        chain, tip, branches = tree.chain(base, first)
        if any(joint.independent for joint in chain):
            found.append(_group("chain", chain, base, tip))
        small = all(tree.depth(joint) <= DEEPEST_FINGER for joint in branches)
        if branches and small and (chain or after_chain or tip == root or not found):
            found.append(_group("hand", tree.below(branches), tip, ""))
        else:
            stems += [(tip, joint, after_chain or bool(chain)) for joint in reversed(branches)]
    return tuple(found)


class _Tree:
    """Joints by parent link, and the number of moving joints in series below each link."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        self._children: dict[str, list[Joint]] = {}
        self._depth: dict[str, int] = {}
        self._independent: dict[str, int] = {}
        for joint in joints:
            self._children.setdefault(joint.parent, []).append(joint)
        for joint in reversed(joints):
            self._depth[joint.parent] = max(self._depth.get(joint.parent, 0), self.depth(joint))
            self._independent[joint.parent] = max(self._independent.get(joint.parent, 0), self._leading(joint))

    def depth(self, joint: Joint) -> int:
        """Most moving joints on a path that begins with `joint`."""
        return joint.moves + self._depth.get(joint.child, 0)

    def _leading(self, joint: Joint) -> int:
        """Most independent joints on a path that begins with `joint`."""
        return joint.independent + self._independent.get(joint.child, 0)

    def chain(self, base: str, first: Joint | None) -> tuple[list[Joint], str, list[Joint]]:
        """Moving joints from `base` (through `first`) to the next branch point; the link there, and its branches."""
        chain: list[Joint] = []
        at, joint = base, first
        while True:
            if joint is None:
                branches = self._branches(at)
                if len(branches) != 1:
                    return chain, at if branches else self._end(at), branches
                joint = branches[0]
            if joint.moves:
                chain.append(joint)
            at, joint = joint.child, None

    def _branches(self, link: str) -> list[Joint]:
        moving = [joint for joint in self._children.get(link, []) if self.depth(joint)]
        leading = [joint for joint in moving if self._leading(joint)]
        return leading if len(leading) == 1 and self._leading(leading[0]) > 1 else moving

    def _end(self, link: str) -> str:
        """The last link of a chain: down fixed joints, preferring a link named as a tool."""
        while link in self._children:
            names = [joint.child for joint in self._children[link] if not joint.moves]
            tools = [name for name in names if any(word in name for word in ("tool", "tcp", "flange", "tip", "ee_"))]
            if not tools and len(names) != 1:
                break
            link = (tools or names)[0]
        return link

    def below(self, branches: Sequence[Joint]) -> list[Joint]:
        """The moving joints of branches, depth first."""
        found: list[Joint] = []
        stack = list(reversed(branches))
        while stack:
            joint = stack.pop()
            if joint.moves:
                found.append(joint)
            stack += reversed(self._children.get(joint.child, []))
        return found


def _group(kind: GroupKind, joints: Sequence[Joint], base: str, tip: str) -> GuessedGroup:
    own = tuple(joint.name for joint in joints if joint.independent)
    return GuessedGroup(kind, own, tuple(joint.name for joint in joints if not joint.independent), base, tip)
