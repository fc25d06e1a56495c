"""Questions about the nodes of a ROS file, and small changes of them."""

from __future__ import annotations

import difflib
import re

from manipcli.spec.ros.nodes import Found, mapping
from manipcli.spec.ros.table import Block, Table, value
from manipcli.spec.ros.tables import PACKAGES
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, child, plain


def commanded_joints(node: MappingNode) -> list[str]:
    """The joints that a controller commands."""
    word, joints = node.get("type"), node.get("joints")
    if not isinstance(word, ScalarNode) or not isinstance(joints, SequenceNode) or "broadcaster" in str(word.value):
        return []
    target = scalar_at(node, "chained_to")
    above = f"{target}/" if target else ""
    return [above + item.value for item in joints.items if isinstance(item, ScalarNode) and isinstance(item.value, str)]


def scalar_at(node: Node, key: str) -> object:
    """The scalar under a key; None without one."""
    found = mapping(node).get(key)
    return found.value if isinstance(found, ScalarNode) else None


def may_be(node: Found, controller: Found) -> bool:
    """Whether these parameters belong to this controller: same name, and one of the two has no namespace."""
    return node.name == controller.name and 1 in (len(node.path), len(controller.path))


def is_vendor_type(word: str) -> bool:
    """Whether this is `package/Class` of a package that is not ROS's, and not a typo of one."""
    package = word.partition("/")[0]
    return re.fullmatch(r"\w+/\w+", word) is not None and not any(is_typo(package, known) for known in PACKAGES)


def is_typo(given: str, known: str) -> bool:
    """Whether at most two letters differ, ignoring case."""
    match = difflib.SequenceMatcher(None, given.casefold(), known.casefold(), autojunk=False)
    return max(len(given), len(known)) - sum(block.size for block in match.get_matching_blocks()) <= 2


def implied(node: MappingNode, table: Table, word: ScalarNode) -> MappingNode:
    """Adds the keys that the ROS type implies."""
    for key, words in table.types[str(word.value)].items():
        if key in node.entries or key.removesuffix("s") in node.entries:
            continue
        plural = key.endswith("interfaces")
        items = tuple(ScalarNode(value(text), word.place) for text in words.split())
        made: Node = SequenceNode(items, word.place) if plural else items[0]
        node = node.with_entry(key, Entry(word.place, made))
    return node


def value_at(node: Node | None, key: str) -> Node | None:
    """The node under a dotted key."""
    for part in key.split("."):
        node = None if node is None else child(node, part)
    return node


def neutral(block: Block, key: str, node: Node) -> bool:
    given = plain(node)
    return any(given == nothing and type(given) is type(nothing) for nothing in block.neutral.get(key, ()))


def renamed(node: MappingNode, block: Block) -> MappingNode:
    """Renames ROS keys to ours; if both are given, ours is used and the other is unknown."""
    return MappingNode(
        {
            (key if (own := block.renamed.get(key)) is None or own in node.entries else own): entry
            for key, entry in node.entries.items()
        },
        node.place,
    )
