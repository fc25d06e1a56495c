"""Tree of a YAML file, with the place of every key and value."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from manipcli.core.errors import Loc, Place
from manipcli.core.text import escape, listed, shorten

Scalar = str | int | float | bool | None
Plain = Scalar | list["Plain"] | dict[str, "Plain"]


@dataclass(frozen=True, slots=True)
class ScalarNode:
    """A string, number, boolean or null.

    Attributes:
        written: the expression that it was computed from.
        given: place of the value of a local parameter in that expression, as in `each:` or `with:`.
    """

    value: Scalar
    place: Place
    written: str | None = None
    given: Place | None = None


@dataclass(frozen=True, slots=True)
class Entry:
    """The node under a key, and the place of the key."""

    key_place: Place
    node: Node


@dataclass(frozen=True, slots=True)
class MappingNode:
    """A mapping, with keys in the order of the file."""

    entries: dict[str, Entry]
    place: Place

    def get(self, key: str) -> Node | None:
        entry = self.entries.get(key)
        return None if entry is None else entry.node

    def with_entry(self, key: str, entry: Entry) -> MappingNode:
        """A copy with `entry` under `key`."""
        return MappingNode({**self.entries, key: entry}, self.place)

    def with_node(self, key: str, node: Node) -> MappingNode:
        """A copy with `node` under `key`; an existing key keeps its place."""
        old = self.entries.get(key)
        return self.with_entry(key, Entry(node.place if old is None else old.key_place, node))

    def without(self, *keys: str) -> MappingNode:
        """A copy without these keys."""
        return MappingNode({key: entry for key, entry in self.entries.items() if key not in keys}, self.place)


@dataclass(frozen=True, slots=True)
class SequenceNode:
    """A list."""

    items: tuple[Node, ...]
    place: Place


Node = ScalarNode | MappingNode | SequenceNode


def merged(a: MappingNode, b: MappingNode) -> MappingNode:
    """A recursive merge of both; `b` overrides `a`."""
    entries = dict(a.entries)
    for key, entry in b.entries.items():
        before = entries.get(key)
        if before is not None and isinstance(before.node, MappingNode) and isinstance(entry.node, MappingNode):
            entry = Entry(before.key_place, merged(before.node, entry.node))
        entries[key] = entry
    return MappingNode(entries, a.place)


def counted(node: Node, most: int) -> int:
    """Number of values in a tree; counting stops beyond `most`."""
    waiting, count = [node], 0
    while waiting and count <= most:
        last = waiting.pop()
        count += 1
        if isinstance(last, MappingNode):
            waiting += [entry.node for entry in last.entries.values()]
        elif isinstance(last, SequenceNode):
            waiting += last.items
    return count


Clash = tuple[tuple[str, ...], Place, Place]


def clashes(a: MappingNode, b: MappingNode, path: tuple[str, ...] = ()) -> Iterator[Clash]:
    """What `merged` drops: the path and both places of values that differ."""
    for key, entry in b.entries.items():
        before = a.entries.get(key)
        if before is None:
            continue
        if isinstance(before.node, MappingNode) and isinstance(entry.node, MappingNode):
            yield from clashes(before.node, entry.node, (*path, key))
        elif plain(before.node) != plain(entry.node):
            yield (*path, key), before.key_place, entry.key_place


PARAMETERS = "ros__parameters"


def has_parameters(*nodes: Node) -> bool:
    """Whether each is the block of a ROS 2 node."""
    return all(isinstance(node, MappingNode) and PARAMETERS in node.entries for node in nodes)


def plain(node: Node) -> Plain:
    """The plain data, without places."""
    if isinstance(node, MappingNode):
        return {key: plain(entry.node) for key, entry in node.entries.items()}
    if isinstance(node, SequenceNode):
        return [plain(item) for item in node.items]
    return node.value


def mapped(node: Node, change: Callable[[ScalarNode, Loc], Node], path: Loc = ()) -> Node:
    """The tree with each scalar replaced by `change(scalar, path)`."""
    if isinstance(node, MappingNode):
        entries = {k: Entry(e.key_place, mapped(e.node, change, (*path, k))) for k, e in node.entries.items()}
        return MappingNode(entries, node.place)
    if isinstance(node, SequenceNode):
        return SequenceNode(tuple(mapped(item, change, (*path, k)) for k, item in enumerate(node.items)), node.place)
    return change(node, path)


def child(node: Node, part: str | int) -> Node | None:
    """The child under a key or index, or None."""
    if isinstance(node, MappingNode):
        return node.get(part) if isinstance(part, str) else None
    if isinstance(node, SequenceNode) and isinstance(part, int) and 0 <= part < len(node.items):
        return node.items[part]
    return None


def node_at(root: Node, path: Loc) -> Node:
    """The node at `path`, or the deepest existing node along it."""
    node = root
    for part in path:
        below = child(node, part)
        if below is None:
            return node
        node = below
    return node


def key_place_at(root: Node, path: Loc) -> Place:
    """Place of the last key of `path`; without such a key, of the deepest existing node along it."""
    parent = node_at(root, path[:-1])
    if path and isinstance(parent, MappingNode) and isinstance(path[-1], str) and path[-1] in parent.entries:
        return parent.entries[path[-1]].key_place
    return node_at(root, path).place


def without(root: MappingNode, path: Loc) -> MappingNode:
    """A copy without the node at `path`; if it is missing, without the deepest existing block along it."""
    key = path[0]
    below = child(root, key)
    if below is None or not isinstance(key, str):
        return root
    if len(path) > 1 and isinstance(below, MappingNode) and child(below, path[1]) is not None:
        return root.with_entry(key, Entry(root.entries[key].key_place, without(below, path[1:])))
    return root.without(key)


def dotted(path: Loc) -> str:
    """The path as text: `scene.cup.mass`, `steps[3].move.to`."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{escape(part)}" if text else escape(part)
    return text


def shown(node: Node) -> str:
    """A short description of a node for messages."""
    if isinstance(node, MappingNode):
        return f"a mapping with the keys {listed(node.entries, most=5)}" if node.entries else "an empty mapping"
    if isinstance(node, SequenceNode):
        return f"a list of {len(node.items)}" if node.items else "an empty list"
    if node.value is None:
        return "nothing"
    if isinstance(node.value, bool):
        return "true" if node.value else "false"
    text = f"'{shorten(node.value)}'" if isinstance(node.value, str) else shorten(repr(node.value), width=24)
    return f"{text} (from '{shorten(node.written)}')" if node.written is not None else text
