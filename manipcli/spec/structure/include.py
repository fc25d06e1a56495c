"""Insertion of fragments: `include: FILE` in `scene:`, `frames:` and in lists of steps, before overrides."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.text import escape
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, dotted
from manipcli.spec.structure.files import FRAGMENT, Files, TaskFile, TooMuch
from manipcli.spec.structure.words import LISTS, is_structured

INCLUDE: Final = "include"
NAMED: Final = ("scene", "frames")


def included(root: Node, files: Files, task: TaskFile) -> Node:
    """The tree of a task with all fragments in place; faulty ones are left out, with findings."""
    if not isinstance(root, MappingNode):
        return root
    try:
        return Inclusion(files, task).whole(root)
    except TooMuch:
        return root.without(*NAMED).with_node("steps", SequenceNode((), root.place))


def _names(block: MappingNode) -> tuple[Node, ...] | None:
    """The nodes with the names of the files under `include`; None without. A body may have this name, too."""
    node = block.get(INCLUDE)
    if node is None or isinstance(node, MappingNode):
        return None
    return node.items if isinstance(node, SequenceNode) else (node,)


@dataclass(frozen=True, slots=True)
class Inclusion:
    """Inserts fragments; `task` is the file that the paths of meshes are relative to."""

    files: Files
    task: TaskFile

    def whole(self, root: MappingNode) -> MappingNode:
        for key in NAMED:
            block = root.get(key)
            if isinstance(block, MappingNode) and _names(block) is not None:
                root = root.with_node(key, self.names(key, block, self.task))
        steps = root.get("steps")
        if steps is None or not is_structured(steps):
            return root
        return root.with_node("steps", self.steps(steps, ("steps",), self.task))

    def names(self, key: str, block: MappingNode, user: TaskFile) -> MappingNode:
        """`scene:` or `frames:` with the entries of its fragments before its own."""
        entries: dict[str, Entry] = {}
        for named in _names(block) or ():
            found = self.section(named, key, (key, INCLUDE), user)
            if found is None:
                continue
            file, section = found
            if not isinstance(section, MappingNode):
                message = f"{key}: expected a mapping by name"
                self.files.reports.add(Diagnostic("TASK265", message, section.place))
                continue
            self.add(key, entries, self.names(key, self.moved(section, file) if key == "scene" else section, file))
        self.add(key, entries, block.without(INCLUDE) if _names(block) is not None else block)
        return MappingNode(entries, block.place)

    def add(self, key: str, entries: dict[str, Entry], more: MappingNode) -> None:
        for name, entry in more.entries.items():
            if name in entries:
                message = f"{key}: duplicate name '{escape(name)}': {entries[name].key_place} has it already"
                hint = "rename one; to change a value of a fragment, use `--set`"
                self.files.reports.add(Diagnostic("TASK273", message, entry.key_place, hint))
            else:
                entries[name] = entry

    def section(self, named: Node, key: str, at: Loc, user: TaskFile) -> tuple[TaskFile, Node] | None:
        """The block under `key` of a fragment."""
        found = self.files.read(named, dotted(at), user, FRAGMENT)
        if found is None:
            return None
        section = found[1].get(key)
        if section is None:
            message = f"{dotted(at)}: the fragment has no `{key}`"
            others = [f"`{other}`" for other in (*NAMED, "steps") if other in found[1].entries]
            hint = f"include it in {' or '.join(others)}: it has that block" if others else f"begin it with `{key}:`"
            self.files.reports.add(Diagnostic("TASK265", message, named.place, hint))
            return None
        return found[0], section

    def moved(self, bodies: MappingNode, file: TaskFile) -> MappingNode:
        """Bodies with the paths of their files relative to the task instead of the fragment."""
        here, there = self.task.path.parent, file.path.parent
        entries: dict[str, Entry] = {}
        for name, entry in bodies.entries.items():
            body = entry.node
            for key in ("mesh", "urdf") if isinstance(body, MappingNode) and here != there else ():
                shape = body.get(key) if isinstance(body, MappingNode) else None
                path = shape.get("file") if isinstance(shape, MappingNode) else None
                if isinstance(path, ScalarNode) and isinstance(path.value, str) and _is_relative(path.value):
                    real = os.path.relpath(there / path.value, here)
                    assert isinstance(shape, MappingNode) and isinstance(body, MappingNode)
                    body = body.with_node(key, shape.with_node("file", ScalarNode(real, path.place)))
            entries[name] = Entry(entry.key_place, body)
        return MappingNode(entries, bodies.place)

    def steps(self, steps: Node, at: Loc, user: TaskFile) -> Node:
        """A list of steps with those of its fragments, also in nested lists."""
        if not isinstance(steps, SequenceNode):
            return steps
        items: list[Node] = []
        for k, item in enumerate(steps.items):
            if isinstance(item, MappingNode) and INCLUDE in item.entries and len(item.entries) == 1:
                for named in _names(item) or (item.entries[INCLUDE].node,):
                    found = self.section(named, "steps", (*at, k, INCLUDE), user)
                    inner = None if found is None else self.steps(found[1], ("steps",), found[0])
                    if isinstance(inner, SequenceNode):
                        items += inner.items
                    elif inner is not None:
                        self.files.reports.add(Diagnostic("TASK265", "steps: expected a list of steps", inner.place))
            else:
                items.append(self.item(item, (*at, k), user))
        return SequenceNode(tuple(items), steps.place)

    def item(self, item: Node, at: Loc, user: TaskFile) -> Node:
        if not isinstance(item, MappingNode):
            return item
        for key in LISTS:
            if key in item.entries:
                item = item.with_node(key, self.steps(item.entries[key].node, (*at, key), user))
        block = item.get("repeat")
        if isinstance(block, MappingNode) and "steps" in block.entries:
            inner = self.steps(block.entries["steps"].node, (*at, "repeat", "steps"), user)
            item = item.with_node("repeat", block.with_node("steps", inner))
        return item


def _is_relative(path: str) -> bool:
    return "://" not in path and "$" not in path and not Path(path).is_absolute()
