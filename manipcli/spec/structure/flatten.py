"""The tree of a task with the structure of its steps replaced by a flat list of steps and the blocks over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.spec.expression import Scope
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, counted, mapped
from manipcli.spec.structure.draft import FlatStep
from manipcli.spec.structure.expand import Expansion
from manipcli.spec.structure.references import in_steps
from manipcli.spec.structure.structure import Structure
from manipcli.spec.structure.words import is_structured

MOST_VALUES: Final = 400_000
"""Values in all flat steps."""
Change = Callable[[Sequence[FlatStep]], tuple[FlatStep, ...]]


def flattened(root: Node, scope: Scope, expansion: Expansion, change: Change) -> tuple[Node, Structure]:
    """The tree with computed, flat steps, and how they are written.

    Args:
        root: the tree, computed but for `steps`.
        scope: the parameters of the task.
        expansion: of this task; gets the findings.
        change: sets values of single flat steps, by their ids.
    """
    if not isinstance(root, MappingNode):
        return root, Structure(scope=scope)
    if "blocks" in root.entries:
        place = root.entries["blocks"].key_place
        hint = "write `sequence`, `repeat`, `if`, `parallel` or `do` in `steps`"
        expansion.reports.add(Diagnostic("TASK201", "unknown key 'blocks'", place, hint))
        root = root.without("blocks")
    entry = root.entries.get("steps")
    if entry is None:
        return root, Structure(scope=scope)
    if not is_structured(entry.node):
        change(())
        return root.with_node("steps", mapped(entry.node, scope.computed, ("steps",))), Structure(scope=scope)
    expanded = expansion.whole(entry.node, scope)
    steps = change(expanded.steps)
    nodes = _computed(steps, expansion)
    dropped = _computed(expanded.dropped, expansion)
    place = entry.node.place
    complete = not any(finding.severity == "error" for finding in expansion.reports.findings)
    if not nodes and not complete:
        nodes = [MappingNode({"wait": Entry(place, ScalarNode(0.0, place))}, place)]
    blocks = tuple(block.node() for block in expanded.blocks)
    root = root.with_node("steps", SequenceNode(tuple(nodes), place))
    root = root.with_entry("blocks", Entry(entry.key_place, SequenceNode(blocks, place)))
    left = SequenceNode(tuple(dropped), place)
    structure = Structure(steps, expanded.blocks, scope, expanded.dropped, left, complete)
    return in_steps(root, structure), structure


def _computed(steps: Sequence[FlatStep], expansion: Expansion) -> list[Node]:
    """The nodes of the steps; the rest is left out, with a finding, if they have too many values."""
    nodes: list[Node] = []
    count = 0
    for step in steps:
        node = step.node()
        count += counted(node, MOST_VALUES)
        if count > MOST_VALUES:
            expansion.reports.at(269, step.at, step.item, f"the steps have more than {MOST_VALUES:,} values")
            break
        nodes.append(node)
    return nodes
