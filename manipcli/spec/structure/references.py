"""Names of blocks where the name of a step is expected."""

from __future__ import annotations

from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode
from manipcli.spec.structure.structure import Structure


def in_steps(root: MappingNode, structure: Structure) -> MappingNode:
    """The tree with the blocks under `during` of expectations and watches replaced by their steps."""
    ids = [step.id for step in structure.steps]
    inside = {block.id: ids[block.first : block.last] for block in structure.blocks}
    for key in ("expect", "watch"):
        items = root.get(key)
        if isinstance(items, SequenceNode):
            changed = tuple(_item(item, inside) for item in items.items)
            root = root.with_node(key, SequenceNode(changed, items.place))
    return root


def _item(item: Node, inside: dict[str, list[str]]) -> Node:
    during = item.get("during") if isinstance(item, MappingNode) else None
    if not isinstance(item, MappingNode) or during is None:
        return item
    named = during.items if isinstance(during, SequenceNode) else (during,)
    if not any(isinstance(node, ScalarNode) and node.value in inside for node in named):
        return item
    steps = [
        inner
        for node in named
        for inner in (
            [ScalarNode(step, node.place) for step in inside[str(node.value)]]
            if isinstance(node, ScalarNode) and node.value in inside
            else [node]
        )
    ]
    return item.with_node("during", SequenceNode(tuple(steps), during.place))
