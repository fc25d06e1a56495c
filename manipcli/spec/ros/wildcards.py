"""ROS 2 wildcard parameters (`/**`, `/*`): defaults for every node of a namespace."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.ros.nodes import Found, has_type, mapping
from manipcli.spec.ros.tables import BY_TYPE, MANAGER
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, merged

_BY_JOINT = ("gains", "constraints")
"""Blocks with one block per joint; a controller reads those of its own joints."""


class Wildcards:
    """The wildcard parameters of one file, without those of other nodes; `taken`: keys that a controller uses."""

    def __init__(self, found: list[Found], models: Mapping[str, type[ControllerSpec]]) -> None:
        self.models = models
        self.shared = [Found(block.path, block.key_place, _without_controllers(block.node)) for block in found]
        self.taken: set[str] = set()

    def given(self, controller: Found) -> Found:
        """The controller with its wildcard parameters; unchanged if it has no type."""
        shared = MappingNode({}, controller.key_place)
        for block in self.shared:
            space = block.path[:-1]
            if controller.path[: len(space)] == space:
                shared = merged(shared, mapping(block.node))
        own = mapping(controller.node)
        both = merged(shared, own)
        if not has_type(both):
            return controller
        takes = {key: entry for key, entry in shared.entries.items() if key == "type" or self.takes(both, key)}
        self.taken |= takes.keys()
        joints = _joints(both)
        for key in _BY_JOINT:
            if key in takes and joints is not None:
                takes[key] = Entry(takes[key].key_place, _of_joints(takes[key].node, joints))
        return Found(controller.path, controller.key_place, merged(MappingNode(takes, own.place), own))

    def takes(self, node: MappingNode, key: str) -> bool:
        """Whether a controller of this type reads the key; True for unsupported types, whose keys are unknown."""
        word = node.get("type")
        kind = str(word.value) if isinstance(word, ScalarNode) else ""
        table = BY_TYPE.get(kind)
        model = self.models.get(kind if table is None else table.own)
        names = () if table is None else table.parameters.names
        return model is None or key in model.model_fields or key in names

    def left(self) -> list[tuple[Found, str, Entry]]:
        """Parameters that no controller uses: their block, key and entry."""
        return [
            (block, key, entry)
            for block in self.shared
            for key, entry in mapping(block.node).entries.items()
            if key not in self.taken
        ]


def _without_controllers(node: Node) -> MappingNode:
    """The node without blocks of controllers and parameters of their manager."""
    entries = mapping(node).entries
    of_others = [key for key, entry in entries.items() if has_type(entry.node) or key in MANAGER.names]
    return mapping(node).without(*of_others)


def _joints(node: MappingNode) -> frozenset[str] | None:
    """The joints that a controller lists; None without a list."""
    joints = node.get("joints")
    if not isinstance(joints, SequenceNode):
        return None
    return frozenset(str(item.value) for item in joints.items if isinstance(item, ScalarNode))


def _of_joints(node: Node, joints: frozenset[str]) -> Node:
    if not isinstance(node, MappingNode):
        return node
    others = [key for key, entry in node.entries.items() if isinstance(entry.node, MappingNode) and key not in joints]
    return node.without(*others)
