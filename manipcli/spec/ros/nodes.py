"""Search for controllers in a ROS file: inside namespaces (ROS 1), or at nodes with parameters (ROS 2)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from manipcli.core.errors import Place
from manipcli.spec.source.tree import PARAMETERS, Entry, MappingNode, Node, ScalarNode, merged

MANAGER = "controller_manager"
Path = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Found:
    """A block at `path` (namespaces, then its name; "" for a wildcard), and the place of its key."""

    path: Path
    key_place: Place
    node: Node

    @property
    def name(self) -> str:
        """The name without namespaces."""
        return self.path[-1] if self.path else ""


def mapping(node: Node | None) -> MappingNode:
    """`node` if it is a mapping, else an empty mapping."""
    return node if isinstance(node, MappingNode) else MappingNode({}, Place("", 0, 0))


def has_type(node: Node) -> bool:
    """Whether this is a block with a string under `type`."""
    word = node.get("type") if isinstance(node, MappingNode) else None
    return isinstance(word, ScalarNode) and isinstance(word.value, str)


def is_ros2(node: Node) -> bool:
    """Whether this node or one below it has ROS 2 parameters."""
    return isinstance(node, MappingNode) and (
        PARAMETERS in node.entries or any(is_ros2(entry.node) for entry in node.entries.values())
    )


def in_namespaces(root: MappingNode, above: Path = ()) -> Iterator[Found]:
    """The blocks of ROS 1; a block without a type that contains typed blocks is a namespace."""
    for key, entry in root.entries.items():
        path = (*above, *_parts(key))
        if isinstance(entry.node, MappingNode) and not has_type(entry.node) and _is_namespace(entry.node):
            yield from in_namespaces(entry.node, path)
        else:
            yield Found(path, entry.key_place, entry.node)


def _is_namespace(node: MappingNode) -> bool:
    inner = [entry.node for entry in node.entries.values()]
    return any(has_type(block) or (isinstance(block, MappingNode) and _is_namespace(block)) for block in inner)


def at_nodes(root: MappingNode, above: Path = ()) -> Iterator[Found]:
    """The ROS 2 nodes and their parameters, and all other blocks. `*` and `**` become "" at the end of a path, and are
    dropped before it.
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
    """Dotted keys as nested blocks: `gains.joint_1.p: 3`."""
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


def named(found: list[Found]) -> list[tuple[str, Found]]:
    """The name of each block, with its namespaces if another block has the same name."""
    names = [item.name for item in found]
    return [(item.name if names.count(item.name) == 1 else "/".join(item.path), item) for item in found]
