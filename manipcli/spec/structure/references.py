"""Names of blocks where the name of a step is expected."""

from __future__ import annotations

from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode
from manipcli.spec.structure.structure import Structure


def in_steps(root: MappingNode, structure: Structure) -> MappingNode:
    """The tree with steps instead of the blocks that expectations and watches name.

    Under `during` these are all steps of the block; under `at` its last one, unless that is in a branch.
    """
    ids = [step.id for step in structure.steps]
    inside = {block.id: ids[block.first : block.last] for block in structure.blocks}
    branching = [block for block in structure.blocks if block.kind == "if"]
    ends = {
        block.id: ids[block.last - 1]
        for block in structure.blocks
        if not any(block.first <= one.first and one.last == block.last for one in branching)
    }
    for key in ("expect", "watch"):
        items = root.get(key)
        if isinstance(items, SequenceNode):
            changed = tuple(_item(item, inside, ends) for item in items.items)
            root = root.with_node(key, SequenceNode(changed, items.place))
    return root


def _item(item: Node, inside: dict[str, list[str]], ends: dict[str, str]) -> Node:
    at = item.get("at") if isinstance(item, MappingNode) else None
    if isinstance(item, MappingNode) and isinstance(at, ScalarNode) and at.value in ends:
        item = item.with_node("at", ScalarNode(ends[str(at.value)], at.place))
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
