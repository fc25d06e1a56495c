"""Files that a task names in its steps and scene: sub-tasks (`do:`) and fragments (`include:`)."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import did_you_mean, escape, nearest, shorten
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, counted, shown
from manipcli.spec.structure.reports import Reports

DEEPEST: Final = 10
"""Files that name each other."""
SUB_TASK: Final = ("description", "version", "params", "steps")
FRAGMENT: Final = ("description", "version", "scene", "frames", "steps")
"""Top-level keys of the files."""
USED: Final = "used at"


MOST_USES: Final = 1000
MOST_VALUES: Final = 400_000
"""Uses of files in a task, and values in them."""


class TooMuch(Exception):
    """Stops the expansion; its finding is already reported."""


class Refused(Exception):
    """A file that a task must not read, or that is missing."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        self.message = message
        self.hint = hint
        super().__init__(message)


Find = Callable[[str, Path], Path]
"""The real path of the file that a file names; raises `Refused`."""
Parse = Callable[[Path, str], tuple[Node | None, list[Diagnostic]]]
"""The tree of a file, whose places have a given name, and the findings on its text; raises `InvalidInput`."""


def within(folder: Path) -> Find:
    """Finds files in a folder and below, symbolic links resolved."""
    root = Path(os.path.realpath(folder))

    def find(name: str, base: Path) -> Path:
        found = Path(os.path.realpath(base.parent / name))
        if not found.is_relative_to(root):
            raise Refused(f"'{escape(name)}' is outside the folder of the task")
        if not found.exists():
            raise Refused(f"there is no file '{escape(name)}'")
        return found

    return find


def no_files(name: str, base: Path) -> Path:
    """For a text that is not a file, as the task in a log."""
    raise Refused(f"'{escape(name)}' cannot be read: this task has no folder")


@dataclass(frozen=True, slots=True)
class TaskFile:
    """A file in use.

    Attributes:
        path: real path.
        name: how places name it.
        calls: where it is used, outermost first; () for the task itself.
        chain: the files around it, and this one.
    """

    path: Path
    name: str
    calls: tuple[Place, ...] = ()
    chain: tuple[Path, ...] = ()


@dataclass(slots=True)
class Files:
    """Reads each file once, and stamps its places with the places of its use."""

    find: Find
    parse: Parse
    reports: Reports
    texts: dict[Path, MappingNode | None] = field(default_factory=dict)
    uses: int = 0
    values: int = 0
    stamped: dict[tuple[Path, tuple[Place, ...]], MappingNode] = field(default_factory=dict)
    by_calls: dict[tuple[Place, ...], TaskFile] = field(default_factory=dict)

    def read(self, named: Node, at: str, user: TaskFile, keys: Sequence[str]) -> tuple[TaskFile, MappingNode] | None:
        """The file that a node names, and its tree; None with findings.

        Args:
            named: the node with the name.
            at: the path of the node, for messages.
            user: the file with the list of steps; a node that an `include` inserted there belongs to its fragment.
            keys: its permitted top-level keys.
        """
        what = "sub-task" if keys is SUB_TASK else "fragment"
        place = named.place
        user = self.by_calls.get(place.calls, user)
        if not isinstance(named, ScalarNode) or not isinstance(named.value, str) or not named.value.strip():
            hint = "write `do: FILE.yaml, with: {NAME: VALUE}`" if keys is SUB_TASK else "write `include: FILE.yaml`"
            message = f"{at}: expected the name of a file, not {shown(named)}"
            self.reports.add(Diagnostic("TASK264", message, place, hint))
            return None
        if "$" in named.value:
            hint = "choose between files with `if`"
            self.reports.add(Diagnostic("TASK264", f"{at}: the name of a file has no parameters", place, hint))
            return None
        try:
            path = self.find(named.value, user.path)
        except Refused as refused:
            self.reports.add(Diagnostic("TASK264", f"{at}: {refused.message}", place, refused.hint))
            return None
        except (OSError, ValueError, RuntimeError):
            self.reports.add(Diagnostic("TASK264", f"{at}: '{shorten(named.value)}' is not a name of a file", place))
            return None
        chain = user.chain or (Path(os.path.realpath(user.path)),)
        if path in chain:
            self.reports.add(
                Diagnostic("TASK264", f"{at}: '{escape(named.value)}' uses itself", place, "remove this use")
            )
            return None
        if len(chain) > DEEPEST:
            self.reports.add(Diagnostic("TASK269", f"{at}: files are nested deeper than {DEEPEST}", place))
            return None
        file = TaskFile(
            path, _shown(named.value, user), (*user.calls, Place(place.file, place.line, place.column)), (*chain, path)
        )
        self.by_calls[file.calls] = file
        root = self.tree(file, f"{at}: ", place, what, keys)
        return None if root is None else (file, root)

    def tree(self, file: TaskFile, at: str, place: Place, what: str, keys: Sequence[str]) -> MappingNode | None:
        """The stamped tree of a file; its findings are reported."""
        if file.path not in self.texts:
            self.texts[file.path] = self.parsed(file, at, place)
        root = self.texts[file.path]
        if root is None:
            return None
        key = (file.path, file.calls)
        if key not in self.stamped:
            self.uses += 1
            self.values += counted(root, MOST_VALUES)
            if self.uses > MOST_USES or self.values > MOST_VALUES:
                most = f"{MOST_USES} uses of files" if self.uses > MOST_USES else f"{MOST_VALUES:,} values"
                self.reports.add(Diagnostic("TASK269", f"{at}the task has more than {most}", place))
                raise TooMuch
            self.stamped[key] = _stamped_mapping(root, file.calls)
        root = self.stamped[key]
        wrong = next((word for word in root.entries if word not in keys), None)
        if wrong is not None:
            message, hint = _wrong_key(wrong, what, keys)
            self.reports.add(Diagnostic("TASK265", message, root.entries[wrong].key_place, hint))
            return None
        return root

    def parsed(self, file: TaskFile, at: str, place: Place) -> MappingNode | None:
        try:
            root, findings = self.parse(file.path, file.name)
        except InvalidInput as invalid:
            root, findings = None, list(invalid.findings)
            if all(finding.place is None or finding.place.line == 0 for finding in findings):
                findings = [replace(f, message=f"{at}{f.message}", place=place) for f in findings]
        for finding in findings:
            if finding.place is not None and finding.place != place:
                finding = replace(finding, place=_used(finding.place, file.calls))
            self.reports.add(finding)
        if isinstance(root, MappingNode):
            return root
        if not findings:
            given = "an empty file" if root is None else shown(root)
            message = f"expected a mapping with the key `steps`, not {given}"
            self.reports.add(Diagnostic("TASK265", message, Place(file.name, 1, 1, file.calls, USED)))
        return None


def _wrong_key(key: str, what: str, keys: Sequence[str]) -> tuple[str, str | None]:
    if key in ("task", "robot", "controllers", "simulation", "expect"):
        return (
            f"a {what} has no `{key}`: this is a task",
            f"keep only {', '.join(f'`{k}`' for k in keys[2:])} in this file",
        )
    if key == "params":
        return "a fragment has no `params`: it uses those of the task", "use the file with `do:` instead"
    if key in FRAGMENT:
        return f"a {what} has no `{key}`", f"include the file in `{key}:` of the task"
    hint = did_you_mean(key, keys, kind="keys")
    if keys is FRAGMENT and not nearest(key, keys):
        hint = "put bodies below `scene:`, frames below `frames:` and steps below `steps:`"
    return f"unknown key '{escape(key)}' in a {what}", hint


def _shown(name: str, user: TaskFile) -> str:
    return name if Path(name).is_absolute() else os.path.normpath(Path(user.name).parent / name)


def _used(place: Place, calls: tuple[Place, ...]) -> Place:
    return Place(place.file, place.line, place.column, calls, USED)


def _stamped(node: Node, calls: tuple[Place, ...]) -> Node:
    if isinstance(node, MappingNode):
        return _stamped_mapping(node, calls)
    if isinstance(node, SequenceNode):
        return SequenceNode(tuple(_stamped(item, calls) for item in node.items), _used(node.place, calls))
    return ScalarNode(node.value, _used(node.place, calls), node.written, node.given)


def _stamped_mapping(node: MappingNode, calls: tuple[Place, ...]) -> MappingNode:
    entries = {
        key: Entry(_used(entry.key_place, calls), _stamped(entry.node, calls)) for key, entry in node.entries.items()
    }
    return MappingNode(entries, _used(node.place, calls))
