"""Where the controllers of a file stand: below names of namespaces (ROS 1), or at nodes with parameters (ROS 2)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from manipcli.core.errors import Place
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode

PARAMETERS = "ros__parameters"
MANAGER = "controller_manager"
Path = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Found:
    """Something at `path` (namespaces, then its name: "" for what is said of all there), and where that is written."""

    path: Path
    key_place: Place
    node: Node

    @property
    def name(self) -> str:
        """Without its namespaces."""
        return self.path[-1] if self.path else ""


def mapping(node: Node | None) -> MappingNode:
    """`node`, or an empty mapping where it is none."""
    return node if isinstance(node, MappingNode) else MappingNode({}, Place("", 0, 0))


def has_type(node: Node) -> bool:
    """Whether this is a block with a text under `type`."""
    word = node.get("type") if isinstance(node, MappingNode) else None
    return isinstance(word, ScalarNode) and isinstance(word.value, str)


def is_ros2(node: Node) -> bool:
    """Whether there are parameters of ROS 2 at or below this."""
    return isinstance(node, MappingNode) and (
        PARAMETERS in node.entries or any(is_ros2(entry.node) for entry in node.entries.values())
    )


def in_namespaces(root: MappingNode, above: Path = ()) -> Iterator[Found]:
    """The blocks of ROS 1; a block without a type whose inner ones have some is a namespace."""
    for key, entry in root.entries.items():
        path = (*above, *_parts(key))
        if isinstance(entry.node, MappingNode) and not has_type(entry.node) and _is_namespace(entry.node):
            yield from in_namespaces(entry.node, path)
        else:
            yield Found(path, entry.key_place, entry.node)


def _is_namespace(node: MappingNode) -> bool:
    inner = [entry.node for entry in node.entries.values()]
    return any(has_type(one) or (isinstance(one, MappingNode) and _is_namespace(one)) for one in inner)


def at_nodes(root: MappingNode, above: Path = ()) -> Iterator[Found]:
    """The nodes of ROS 2 and their parameters; then what is no node. `*` and `**` are "" at the end of a path, and left
    out before it.
    """
    for key, entry in root.entries.items():
        path = (*above, *_parts(key))
        if not isinstance(entry.node, MappingNode) or not is_ros2(entry.node):
            yield Found(path, entry.key_place, entry.node)
            continue
        if PARAMETERS in entry.node.entries:
            name = ("",) if key.endswith("*") else ()
            yield Found((*path, *name), entry.key_place, undotted(mapping(entry.node.get(PARAMETERS))))
        yield from at_nodes(entry.node.without(PARAMETERS), path)


def _parts(key: str) -> Path:
    return tuple(part for part in key.split("/") if part not in ("", "*", "**"))


def undotted(node: MappingNode) -> MappingNode:
    """`gains.joint_1.p: 3` as the blocks that it means."""
    entries: dict[str, Entry] = {}
    for key, entry in node.entries.items():
        inner = undotted(entry.node) if isinstance(entry.node, MappingNode) else entry.node
        first, dot, rest = key.partition(".")
        if dot and first and rest:
            inner = undotted(MappingNode({rest: Entry(entry.key_place, inner)}, entry.key_place))
            key = first
        before = entries.get(key)
        if before is not None and isinstance(before.node, MappingNode) and isinstance(inner, MappingNode):
            entries[key] = Entry(before.key_place, merged(before.node, inner))
        else:
            entries[key] = Entry(entry.key_place, inner)
    return MappingNode(entries, node.place)


def merged(a: MappingNode, b: MappingNode) -> MappingNode:
    """Both, to the depth of their blocks; where they differ, `b`."""
    entries = dict(a.entries)
    for key, entry in b.entries.items():
        before = entries.get(key)
        if before is not None and isinstance(before.node, MappingNode) and isinstance(entry.node, MappingNode):
            entry = Entry(before.key_place, merged(before.node, entry.node))
        entries[key] = entry
    return MappingNode(entries, a.place)


def named(found: list[Found]) -> list[tuple[str, Found]]:
    """What each is called: its name alone, and with its namespaces where two have the same one."""
    names = [one.name for one in found]
    return [(one.name if names.count(one.name) == 1 else "/".join(one.path), one) for one in found]
