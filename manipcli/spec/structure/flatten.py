"""The tree of a task with the structure of its steps replaced by a flat list of steps and the blocks over it."""

from __future__ import annotations

from collections.abc import Collection

from manipcli.core.errors import Diagnostic
from manipcli.spec.expression import Scope
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, mapped
from manipcli.spec.structure.expand import Expansion
from manipcli.spec.structure.structure import Structure
from manipcli.spec.structure.words import is_structured


def flattened(root: Node, scope: Scope, verbs: Collection[str]) -> tuple[Node, Structure, list[Diagnostic]]:
    """The tree with computed, flat steps; how they are written; and the findings of the structure.

    Args:
        root: the tree, computed but for `steps`.
        scope: the parameters of the task.
        verbs: the words of steps.
    """
    if not isinstance(root, MappingNode):
        return root, Structure(scope=scope), []
    findings: list[Diagnostic] = []
    if "blocks" in root.entries:
        place = root.entries["blocks"].key_place
        hint = "write `sequence`, `repeat`, `if`, `parallel` or `do` in `steps`"
        findings.append(Diagnostic("TASK201", "unknown key 'blocks'", place, hint))
        root = root.without("blocks")
    entry = root.entries.get("steps")
    if entry is None:
        return root, Structure(scope=scope), findings
    if not is_structured(entry.node):
        steps = mapped(entry.node, scope.computed, ("steps",))
        return root.with_node("steps", steps), Structure(scope=scope), findings
    expanded = Expansion(verbs).whole(entry.node, scope)
    findings += expanded.findings
    place = entry.node.place
    nodes = [step.node() for step in expanded.steps]
    if not nodes and any(finding.severity == "error" for finding in findings):
        nodes = [MappingNode({"wait": Entry(place, ScalarNode(0.0, place))}, place)]
    blocks = tuple(block.node() for block in expanded.blocks)
    root = root.with_node("steps", SequenceNode(tuple(nodes), place))
    root = root.with_entry("blocks", Entry(entry.key_place, SequenceNode(blocks, place)))
    return root, Structure(expanded.steps, expanded.blocks, scope), findings
