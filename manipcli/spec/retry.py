"""A step with the other parameters of its retries: `on_fail: {retry: 2, with: {tilt: 140 deg}}`."""

from __future__ import annotations

from dataclasses import replace

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.spec.expression import escaped, no_params, substitute
from manipcli.spec.located import Located, validate
from manipcli.spec.source.tree import (
    Entry,
    MappingNode,
    Node,
    Plain,
    ScalarNode,
    SequenceNode,
    child,
    mapped,
    node_at,
    plain,
)
from manipcli.spec.step import StepSpec
from manipcli.spec.structure.structure import Structure
from manipcli.spec.task import TaskSpec


def retried(file: Located[TaskSpec], index: int) -> StepSpec:
    """The step `steps[index]` of a task with the parameters under its `on_fail`; without any, the step unchanged.

    Raises:
        InvalidInput: a parameter is unknown, or the step is invalid with it; places are those of the file.
    """
    source, step = file.source, file.spec.steps[index]
    changed = node_at(source.root, ("steps", index, "on_fail", "with"))
    if step.retry is None or not step.retry.with_ or not isinstance(changed, MappingNode):
        return step
    if source.structure.steps:
        return _in_structure(file, index, changed)
    root = mapped(source.root, _written)
    assert isinstance(root, MappingNode)
    params = child(root, "params")
    entries = {} if not isinstance(params, MappingNode) else dict(params.entries)
    unknown_params = []
    for name, entry in changed.entries.items():
        if name not in entries:
            path = ("steps", index, "on_fail", "with", name)
            hint = did_you_mean(name, entries, kind="params") or no_params(name)
            unknown_params.append(source.finding(203, path, f"unknown parameter '{name}'", hint=hint, key=True))
        entries[name] = Entry(entry.key_place, mapped(entry.node, _escaped))
    block = Entry(changed.place, MappingNode(entries, changed.place))
    changed_root = MappingNode({"params": block, **root.without("params").entries}, root.place)
    substituted, scope = substitute(changed_root)
    assert isinstance(substituted, MappingNode)
    steps = mapped(node_at(substituted, ("steps",)), scope.computed, ("steps",))
    tree = replace(source, root=substituted.with_node("steps", steps), unknown=frozenset(scope.unknown))
    return validate(tree, type(file.spec), findings=[*unknown_params, *scope.findings]).spec.steps[index]


def _in_structure(file: Located[TaskSpec], index: int, changed: MappingNode) -> StepSpec:
    """As `retried`, of a step of a structured task: parameters of its round or sub-task, or of the task."""
    source, step = file.source, file.source.structure.steps[index]
    path = ("steps", index, "on_fail", "with")
    unknown = [
        source.finding(203, (*path, name), f"unknown parameter '{name}'", key=True,
                       hint=did_you_mean(name, step.scope.names, kind="params") or no_params(name))
        for name in changed.entries
        if name not in step.scope.names
    ]  # fmt: skip
    params = mapped(child(source.root, "params") or MappingNode({}, changed.place), _written)
    for name, entry in changed.entries.items():
        if name not in step.scope.local and isinstance(params, MappingNode):
            params = params.with_node(name, mapped(entry.node, _escaped))
    _, scope = substitute(MappingNode({"params": Entry(changed.place, params)}, changed.place))
    local = {name: changed.get(name) or step.scope.nodes[name] for name in step.scope.local}
    step = replace(step, scope=scope.inner(local, isolated=step.scope.isolated))
    steps = SequenceNode((step.node(),), changed.place)
    root = source.root
    assert isinstance(root, MappingNode)
    tree = replace(
        source,
        root=root.with_node("steps", steps).without("blocks"),
        unknown=frozenset(scope.unknown),
        structure=Structure((step,)),
    )
    return validate(tree, type(file.spec), findings=[*unknown, *scope.findings]).spec.steps[0]


def expressions(file: Located[TaskSpec]) -> dict[Loc, Plain]:
    """What `resolved` writes of a task for `retried`, by path.

    The expressions of steps with other parameters in a retry, and of `params:`; at `("blocks", j, "params")` the
    parameters of the round or sub-task around such a step.
    """
    steps = [k for k, step in enumerate(file.spec.steps) if step.retry is not None and step.retry.with_]
    found: dict[Loc, Plain] = {}

    def note(node: ScalarNode, path: Loc) -> Node:
        if node.written is not None and path[2:3] != ("on_fail",):
            found[path] = node.written
        return node

    root = file.source.root
    params = child(root, "params") if steps else None
    if params is not None:
        mapped(params, note, ("params",))
    for k in steps:
        mapped(node_at(root, ("steps", k)), note, ("steps", k))
    for j, block in enumerate(file.source.structure.blocks):
        if block.given and any(block.first <= k < block.last for k in steps):
            found["blocks", j, "params"] = {name: plain(mapped(node, _escaped)) for name, node in block.given.items()}
    return found


def _written(node: ScalarNode, path: Loc) -> ScalarNode:
    """The expression that a value was computed from; else the value, escaped."""
    return _escaped(node, path) if node.written is None else ScalarNode(node.written, node.place)


def _escaped(node: ScalarNode, path: Loc) -> ScalarNode:
    return ScalarNode(escaped(node.value), node.place) if isinstance(node.value, str) else node
