"""Overrides: `--set PATH=VALUE` replaces or adds one value before validation.

PATH is dotted. Paths that begin with `robot.` or `controllers.` address those files
(`controllers.arm_controller.gains.joint_1.p`, also for ROS files: overrides apply after these are rewritten);
all other paths address the task. List items are addressed by index from 0, steps also by id
(`steps.0.pour.tilt`, `steps.pour_1.pour.tilt`), steps in blocks by their whole id
(`steps.stack[2]/pick_1.pick.object`). User-defined keys (bodies, joints, poses, parameters) must exist, unless they
end the path. VALUE is YAML: `80 g`, `true`, `[1, 2]`, `{radius: 4 cm}`; `null` restores a default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import NoneType

from manipcli.core.errors import Diagnostic, InvalidInput, Loc, Place
from manipcli.core.text import did_you_mean, escape, listed, number_of, shorten
from manipcli.spec.base import Model
from manipcli.spec.located import Area
from manipcli.spec.source import shape
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, dotted, shown
from manipcli.spec.source.yaml import parse
from manipcli.spec.structure.draft import FlatStep
from manipcli.spec.structure.ids import step_ids
from manipcli.spec.structure.words import LISTS

_FILES: dict[str, Area] = {"robot": "ROBOT", "controllers": "CTRL"}


@dataclass(frozen=True, slots=True)
class Override:
    """One override: the file, the path in it, the value, and the argument that the user typed."""

    area: Area
    path: tuple[str, ...]
    value: Node
    place: Place


def read_override(text: str) -> Override:
    """Parses `PATH=VALUE`.

    Raises:
        InvalidInput: no `=`, an empty path or value, or a value that is not YAML.
    """
    place = Place(f"--set {shorten(text, width=80)}", 0, 0)
    path_text, equals, value_text = text.partition("=")
    parts = tuple(part.strip() for part in path_text.strip().split("."))
    if not equals or not all(parts):
        hint = "write --set scene.cup.mass='80 g'"
        raise InvalidInput([Diagnostic("TASK212", "expected PATH=VALUE", place, hint=hint)])
    if not value_text.strip():
        hint = "write null to restore a default"
        raise InvalidInput([Diagnostic("TASK212", "the value is missing", place, hint=hint)])
    try:
        value = parse(value_text, place.file)
    except InvalidInput as error:
        raise InvalidInput([Diagnostic(f.code, f.message, place, hint=f.hint) for f in error.findings]) from None
    area: Area = "TASK"
    if len(parts) > 1 and parts[0] in _FILES:
        area, parts = _FILES[parts[0]], parts if parts[0] == "controllers" else parts[1:]
    return Override(area, parts, ScalarNode(None, place) if value is None else _moved(value, place), place)


def seed_override(seed: int) -> Override:
    """The override of `--seed N`."""
    place = Place(f"--seed {seed}", 0, 0)
    return Override("TASK", ("simulation", "seed"), ScalarNode(seed, place), place)


def read_overrides(texts: Sequence[str]) -> tuple[Override, ...]:
    """Parses all overrides.

    Raises:
        InvalidInput: with the findings of all of them.
    """
    overrides: list[Override] = []
    findings: list[Diagnostic] = []
    for text in texts:
        try:
            overrides.append(read_override(text))
        except InvalidInput as error:
            findings.extend(error.findings)
    if findings:
        raise InvalidInput(findings)
    return tuple(overrides)


def apply(root: Node, overrides: Sequence[Override], model: type[Model], area: Area) -> tuple[Node, list[Diagnostic]]:
    """The tree with the overrides of this kind of file applied in order, and the diagnostics of invalid paths."""
    findings: list[Diagnostic] = []
    for override in overrides:
        if override.area != area:
            continue
        try:
            root = _set(root, override, (), override.path, model)
        except InvalidInput as error:
            findings.extend(error.findings)
    return root, findings


def of_structure(
    overrides: Sequence[Override],
) -> tuple[tuple[Override, ...], tuple[Override, ...], tuple[Override, ...]]:
    """The overrides of `include:`, which come first; all others; and those of one expanded step: `stack[2]/pick_1`."""
    files = tuple(o for o in overrides if o.area == "TASK" and o.path[-1] == "include")
    late = tuple(o for o in overrides if o.area == "TASK" and o.path[0] == "steps" and "/" in "".join(o.path[1:2]))
    return files, tuple(o for o in overrides if o not in files and o not in late), late


def apply_to_steps(
    steps: Sequence[FlatStep], overrides: Sequence[Override], model: type[Model]
) -> tuple[tuple[FlatStep, ...], list[Diagnostic]]:
    """The expanded steps with the overrides of single steps, and the diagnostics of invalid paths."""
    changed, findings = list(steps), list[Diagnostic]()
    ids = [step.id for step in steps]
    for override in overrides:
        own, *rest = override.path[1:]
        try:
            if own not in ids:
                message = f"there is no step '{escape(own)}'"
                raise _nowhere(override, message, did_you_mean(own, ids, kind="steps"))
            k = ids.index(own)
            item = _set(changed[k].item, override, ("steps", k), tuple(rest), model)
            changed[k] = replace(changed[k], item=item)
        except InvalidInput as error:
            findings.extend(error.findings)
    return tuple(changed), findings


def _moved(node: Node, place: Place) -> Node:
    if isinstance(node, MappingNode):
        return MappingNode({key: Entry(place, _moved(entry.node, place)) for key, entry in node.entries.items()}, place)
    if isinstance(node, SequenceNode):
        return SequenceNode(tuple(_moved(item, place) for item in node.items), place)
    return ScalarNode(node.value, place)


def _set(node: Node, override: Override, done: Loc, rest: tuple[str, ...], model: type[Model]) -> Node:
    """`node` with the value set at `rest` below it; `done` is the path to `node`."""
    if not rest:
        return override.value
    part, further = rest[0], rest[1:]
    if isinstance(node, SequenceNode):
        index = _index(node, override, done, part)
        items = list(node.items)
        items[index] = _set(items[index], override, (*done, index), further, model)
        return SequenceNode(tuple(items), node.place)
    if isinstance(node, ScalarNode) and node.value is None:
        node = MappingNode({}, override.place)
    if isinstance(node, ScalarNode):
        raise _nowhere(override, f"'{dotted(done)}' has no '{escape(part)}': it is {shown(node)}", None)
    entry = node.entries.get(part)
    if entry is None:
        if further or done == ("params",):  # a new parameter has no effect: nothing uses it
            _may_be_added(node, override, done, part, model)
        entry = Entry(override.place, MappingNode({}, override.place))
    if not further and _is_null(override.value) and _left_to_default(model, done, part):
        return node.without(part)
    below = _set(entry.node, override, (*done, part), further, model)
    return node.with_entry(part, Entry(entry.key_place, below))


def _is_null(value: Node) -> bool:
    return isinstance(value, ScalarNode) and value.value is None


def _left_to_default(model: type[Model], done: Loc, part: str) -> bool:
    """Whether the key is optional but cannot be null."""
    known = [shape.keys_of([kind]).get(part) for kind in shape.at(model, done, {})]
    fields = [field for field in known if field is not None]
    kinds = [kind for field in fields for kind, _ in shape.alternatives(field.annotation)]
    return any(not field.is_required() for field in fields) and NoneType not in kinds


def _may_be_added(node: MappingNode, override: Override, done: Loc, part: str, model: type[Model]) -> None:
    kinds = shape.at(model, done, {})
    fields = shape.keys_of(kinds)
    if part in fields:
        return
    known = dict.fromkeys((*node.entries, *(() if shape.takes_any_key(kinds) else fields)))
    where = f"in '{dotted(done)}'" if done else "at the top of the file"
    hint = did_you_mean(part, known, kind="known")
    if hint is None:
        path = ("robot", *done, part) if override.area == "ROBOT" else (*done, part)
        hint = f"there is nothing at this path yet: give the whole block, {'.'.join(map(str, path))}={{...}}"
    raise _nowhere(override, f"there is no '{escape(part)}' {where}", hint)


def _index(node: SequenceNode, override: Override, done: Loc, part: str) -> int:
    ids = step_ids(node) if done[0] == "steps" and done[-1] in ("steps", *LISTS) else ()
    if part in ids:
        return ids.index(part)
    if part.isascii() and part.isdecimal() and len(part) < 7 and int(part) < len(node.items):
        return int(part)
    many = f"'{dotted(done)}' has {number_of(len(node.items), 'item')}, counted from 0"
    hint = f"steps: {listed(ids)}" if ids else None
    if ids and not part.isdecimal():
        hint = did_you_mean(part, ids, kind="steps")
    raise _nowhere(override, f"there is no item '{escape(part)}': {many}", hint)


def _nowhere(override: Override, message: str, hint: str | None) -> InvalidInput:
    return InvalidInput([Diagnostic(f"{override.area}212", message, override.place, hint=hint)])
