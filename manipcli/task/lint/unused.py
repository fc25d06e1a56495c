"""Names that a task declares and never uses: params, frames, bodies and controllers.

A name is used where a text in the task equals it, or is a path that begins with it (`robot/palm`, `scene.cup.mass`):
this holds for every field that takes a name, also where it has one form of several. It can miss an unused name, and
does not report a used one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from manipcli.control.chain import target_of
from manipcli.core.errors import Diagnostic
from manipcli.core.text import escape, listed
from manipcli.plan.claimed_joints import Claims
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode
from manipcli.task.switches import active_in
from manipcli.task.task import Task

_PARAM: Final = re.compile(r"\$(\w+)")
_PART: Final = re.compile(r"[^./\[\]]+")


def unused(task: Task) -> Iterator[Diagnostic]:
    """TASK320: a parameter. TASK321: a frame. TASK322 (note): movable bodies. TASK323: a controller."""
    root = task.file.source.root
    if not isinstance(root, MappingNode):
        return
    yield from _params(task, root)
    yield from _frames(task, root)
    yield from _bodies(task, root)
    yield from _controllers(task)


def _params(task: Task, root: MappingNode) -> Iterator[Diagnostic]:
    used = {name for _, node in _scalars(root) for name in _PARAM.findall(node.written or "")}
    scope = task.file.source.structure.scope
    used |= scope.used if scope is not None else set()
    for name in task.spec.params:
        if name not in used:
            message = f"the parameter '{escape(name)}' is not used"
            hint = f"write `${escape(name)}` where its value belongs, or remove it"
            yield task.file.source.finding(320, ("params", name), message, hint=hint, severity="warning", key=True)


def _frames(task: Task, root: MappingNode) -> Iterator[Diagnostic]:
    for name in task.spec.frames:
        if name not in _named(root, ("frames", name)):
            message, hint = f"the frame '{escape(name)}' is not used", "name it in a step or a condition, or remove it"
            yield task.file.source.finding(321, ("frames", name), message, hint=hint, severity="warning", key=True)


def _bodies(task: Task, root: MappingNode) -> Iterator[Diagnostic]:
    """One note for all: a movable body that nothing names is clutter, which may be intended."""
    scenery = [
        name for name, body in task.spec.scene.items() if not body.fixed and name not in _named(root, ("scene", name))
    ]
    if scenery:
        message = f"no step and no condition names {listed([escape(name) for name in scenery], most=3)}"
        message += ": only an obstacle" if len(scenery) == 1 else ": only obstacles"
        yield task.file.source.finding(322, ("scene", scenery[0]), message, severity="note", key=True)


def _controllers(task: Task) -> Iterator[Diagnostic]:
    specs = task.controllers.controllers
    active = set().union(*active_in(task.spec.steps, Claims.of(task.controllers), task.robot))
    active |= {target for name in active if (target := target_of(specs[name])) is not None}
    for name in specs:
        if name not in active:
            place = task.controllers_file.source.key_place("controllers", name)
            message = f"the controller '{escape(name)}' is never active in task '{task.name}'"
            hint = "activate it with `switch_controllers`, set `active: true`, or remove it"
            yield Diagnostic("TASK323", message, place, hint, "warning")


def _named(root: MappingNode, own: tuple[str, str]) -> frozenset[str]:
    """The names in all texts, and in the keys outside of declarations, without those of the block at `own`."""
    found: set[str] = set()
    for path, node in _scalars(root):
        if path[:2] == own:
            continue
        if isinstance(node.value, str):
            found |= {node.value, *_PART.findall(node.value)}
        declared = path[0] in ("scene", "frames", "params")
        found |= {part for key in path[2 if declared else 1 :] for part in (key, *_PART.findall(key))}
    return frozenset(found)


def _scalars(node: Node, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], ScalarNode]]:
    """Every scalar, with the keys that lead to it."""
    match node:
        case ScalarNode():
            yield path, node
        case MappingNode():
            for key, entry in node.entries.items():
                yield from _scalars(entry.node, (*path, key))
        case SequenceNode():
            for item in node.items:
                yield from _scalars(item, path)
