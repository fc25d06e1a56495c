"""The tree of a task with the structure of its steps replaced by a flat list of steps and the blocks over it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from manipcli.core.errors import Diagnostic, Place
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
    if isinstance(entry.node, SequenceNode) and not entry.node.items and not _is_complete(scope, expansion):
        place = entry.node.place
        return root.with_node("steps", _placeholder(place)), Structure(scope=scope, complete=False)
    if not is_structured(entry.node, expansion.verbs):
        change(())
        return root.with_node("steps", mapped(entry.node, scope.computed, ("steps",))), Structure(scope=scope)
    expanded = expansion.whole(entry.node, scope)
    steps = change(expanded.steps)
    nodes = _computed(steps, expansion)
    dropped = _computed(expanded.dropped, expansion)
    place = entry.node.place
    if not nodes and expanded.dropped:
        message = "no step is left: all are in branches that are never taken"
        expansion.reports.at(270, ("steps",), entry.node, message, "change the condition or the parameters")
    complete = _is_complete(scope, expansion)
    blocks = tuple(block.node() for block in expanded.blocks)
    flat = SequenceNode(tuple(nodes), place) if nodes or complete else _placeholder(place)
    root = root.with_node("steps", flat)
    root = root.with_entry("blocks", Entry(entry.key_place, SequenceNode(blocks, place)))
    left = SequenceNode(tuple(dropped), place)
    structure = Structure(steps, expanded.blocks, scope, expanded.dropped, left, complete)
    return in_steps(root, structure), structure


def _is_complete(scope: Scope, expansion: Expansion) -> bool:
    """Whether nothing was left out because of an error."""
    return not any(finding.severity == "error" for finding in (*scope.findings, *expansion.reports.findings))


def _placeholder(place: Place) -> SequenceNode:
    """A valid list of steps instead of one whose items are all faulty."""
    return SequenceNode((MappingNode({"wait": Entry(place, ScalarNode(0.0, place))}, place),), place)


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
