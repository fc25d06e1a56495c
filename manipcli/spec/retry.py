"""A step as it reads with other parameters: what `on_fail: {retry: 2, with: {tilt: 140 deg}}` tries."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.spec.expression import escaped, no_params, substitute
from manipcli.spec.located import Located, validate
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, child, node_at
from manipcli.spec.task import StepSpec, TaskSpec


def retried(file: Located[TaskSpec], index: int) -> StepSpec:
    """The step `steps[index]` of a task with the parameters under its `on_fail`; without any, as it is.

    Raises:
        InvalidInput: a parameter is unknown, or the step cannot be meant with it; told at the places of the file.
    """
    source, step = file.source, file.spec.steps[index]
    changed = node_at(source.root, ("steps", index, "on_fail", "with"))
    if step.retry is None or not step.retry.with_ or not isinstance(changed, MappingNode):
        return step
    root = _written(source.root)
    assert isinstance(root, MappingNode)
    params = child(root, "params")
    entries = {} if not isinstance(params, MappingNode) else dict(params.entries)
    told = []
    for name, entry in changed.entries.items():
        if name not in entries:
            path = ("steps", index, "on_fail", "with", name)
            hint = did_you_mean(name, entries, kind="params") or no_params(name)
            told.append(source.finding(203, path, f"unknown parameter '{name}'", hint=hint, key=True))
        entries[name] = Entry(entry.key_place, _escaped(entry.node))
    block = Entry(changed.place, MappingNode(entries, changed.place))
    changed_root = MappingNode({"params": block, **root.without("params").entries}, root.place)
    again, findings, unknown = substitute(changed_root)
    tree = replace(source, root=again, unknown=unknown)
    return validate(tree, type(file.spec), findings=[*told, *findings]).spec.steps[index]


def expressions(file: Located[TaskSpec]) -> dict[Loc, str]:
    """What was written, by its path, where a step that is tried again with other parameters needs it."""
    steps = [k for k, step in enumerate(file.spec.steps) if step.retry is not None and step.retry.with_]
    if not steps:
        return {}
    root = file.source.root
    found = dict(_expressions(child(root, "params"), ("params",)))
    for k in steps:
        at: Loc = ("steps", k)
        found.update((path, text) for path, text in _expressions(node_at(root, at), at) if path[2] != "on_fail")
    return found


def _expressions(node: Node | None, path: Loc) -> Iterator[tuple[Loc, str]]:
    if isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            yield from _expressions(entry.node, (*path, key))
    elif isinstance(node, SequenceNode):
        for k, item in enumerate(node.items):
            yield from _expressions(item, (*path, k))
    elif node is not None and node.written is not None:
        yield path, node.written


def _written(node: Node) -> Node:
    """The tree before expressions were computed."""
    if isinstance(node, MappingNode):
        return MappingNode({k: Entry(e.key_place, _written(e.node)) for k, e in node.entries.items()}, node.place)
    if isinstance(node, SequenceNode):
        return SequenceNode(tuple(map(_written, node.items)), node.place)
    return _escaped(node) if node.written is None else ScalarNode(node.written, node.place)


def _escaped(node: Node) -> Node:
    """A value that is to stay as it is."""
    if isinstance(node, ScalarNode) and isinstance(node.value, str):
        return ScalarNode(escaped(node.value), node.place)
    return node
