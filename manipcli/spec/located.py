"""A validated spec with the place of every value in its file, for the diagnostics of later stages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from typing import Final, Generic, Literal, TypeVar

from pydantic import ValidationError

from manipcli.core.errors import Diagnostic, InvalidInput, Loc, Place, Severity
from manipcli.core.text import listed, shorten
from manipcli.core.version import __version__
from manipcli.spec.base import Model
from manipcli.spec.explain import explain, with_origin
from manipcli.spec.source.tree import (
    MappingNode,
    Node,
    Plain,
    ScalarNode,
    child,
    dotted,
    key_place_at,
    node_at,
    plain,
    shown,
)
from manipcli.spec.structure.structure import Structure

M = TypeVar("M", bound=Model)

Area = Literal["TASK", "ROBOT", "CTRL"]

UNCOMPUTED: Final = ("TASK203", "TASK211")
"""Codes of an expression without a value: `MISNAMED` errors at the same place are dropped."""
MISNAMED: Final = "TASK23"
TWICE: Final = "YAML106"
"""Code of a duplicate key: its second value is dropped, so `UNNAMED` errors in the same file are dropped, too."""
UNKNOWN_NAME: Final = 230
"""Number of names of bodies, frames, steps and poses that do not exist."""
UNNAMED: Final = ("TASK225", "TASK227", "TASK230")


@dataclass(frozen=True, slots=True)
class Source:
    """The tree of a file after parameters and overrides.

    Attributes:
        name: of the file, as places show it.
        root: the tree.
        area: prefix of the file's codes.
        kept: indices in the file of the items that remain, by list; only for lists with removed items.
        whole: the tree before values were removed or replaced; None if none were.
        unknown: places of values that cannot be computed, because their inputs were refused.
        structure: of a task: where its steps and blocks are written, and the parameters there.
    """

    name: str
    root: Node
    area: Area
    kept: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    whole: Node | None = None
    unknown: frozenset[Place] = frozenset()
    structure: Structure = field(default_factory=Structure)

    def plain(self) -> Plain:
        """The plain data, without places."""
        return plain(self.root)

    def untouched(self, *path: str) -> bool:
        """Whether no value at or below `path` was removed or replaced."""
        before: Node | None = self.whole
        now: Node | None = self.root
        for part in path if before is not None else ():
            before, now = before and child(before, part), now and child(now, part)
        return self.whole is None or before is now

    def place(self, *path: str | int) -> Place:
        """Place of the value at `path`; for a missing value, of the nearest enclosing block."""
        return node_at(self.root, path).place

    def key_place(self, *path: str | int) -> Place:
        """Place of the key at `path`."""
        return key_place_at(self.root, path)

    def finding(
        self,
        number: int,
        path: Loc,
        message: str,
        *,
        hint: str | None = None,
        severity: Severity = "error",
        key: bool = False,
    ) -> Diagnostic:
        """A diagnostic at the value (with `key`: at the key) at `path`; the code is the file's area and `number`."""
        place = self.key_place(*path) if key else self.place(*path)
        if not key:
            node = node_at(self.root, path)
            parameter = self._parameter(path, node) if number == UNKNOWN_NAME else None
            hint = parameter or with_origin(hint, node)
        where = f"{dotted(self.in_file(path))}: " if path else ""
        return Diagnostic(f"{self.area}{number}", f"{where}{message}", place, hint=hint, severity=severity)

    def _parameter(self, path: Loc, node: Node) -> str | None:
        """Hint for an unknown name that is a parameter without its dollar sign."""
        name = node.value if isinstance(node, ScalarNode) and node.written is None else None
        scope = self.structure.scope
        if path[:1] == ("steps",) and isinstance(path[1], int) and path[1] < len(self.structure.steps):
            scope = self.structure.steps[path[1]].scope
        return f"write `${name}`: '{name}' is a parameter" if scope is not None and name in scope.nodes else None

    def in_file(self, path: Loc) -> Loc:
        """A path in this tree as it is in the file."""
        if len(path) > 1 and isinstance(path[0], str) and isinstance(path[1], int) and path[0] in self.kept:
            path = (path[0], self.kept[path[0]][path[1]], *path[2:])
        return self.structure.written(path)


@dataclass(frozen=True, slots=True)
class Located(Generic[M]):
    """A validated spec and its source. `findings`: warnings and notes; errors are raised."""

    spec: M
    source: Source
    findings: tuple[Diagnostic, ...] = ()

    def place(self, *path: str | int) -> Place:
        """Place of a value: `place("scene", "cup", "mass")`, `place("steps", 3, "move", "to")`."""
        return self.source.place(*path)


def validate(source: Source, model: type[M], *, findings: Sequence[Diagnostic]) -> Located[M]:
    """Validates a source.

    Args:
        source: the tree.
        model: the spec to validate against.
        findings: earlier findings on the file; their errors are raised together with the model's.

    Raises:
        InvalidInput: with all findings.
    """
    earlier = apart(findings, source.unknown)
    if not any(finding.code.startswith("YAML") for finding in earlier):
        _check_top(source, model)
    _check_version(source)
    try:
        spec = model.model_validate(plain(source.root))
    except ValidationError as error:
        # A failed expression stays in the tree as text: pydantic's error at its place is redundant.
        places = {finding.place for finding in earlier if finding.severity == "error"} | source.unknown
        more = [
            f for f in explain(error, source.root, model, source.area, in_file=source.in_file) if f.place not in places
        ]
        raise InvalidInput([*earlier, *more]) from None
    except RecursionError:
        raise InvalidInput([*earlier, source.finding(205, (), "nested too deeply")]) from None
    if any(finding.severity == "error" for finding in earlier):
        raise InvalidInput(earlier)
    return Located(spec, source, earlier)


def apart(findings: Sequence[Diagnostic], unknown: AbstractSet[Place]) -> tuple[Diagnostic, ...]:
    """The findings without those that only follow from an error in the text, or from a value that is `unknown`."""
    places = {finding.place for finding in findings if finding.code.startswith("YAML")}
    uncomputed = {finding.place for finding in findings if finding.code in UNCOMPUTED}
    halved = {finding.place.file for finding in findings if finding.code == TWICE and finding.place is not None}
    return tuple(
        finding
        for finding in findings
        if finding.code.startswith("YAML")
        or finding.place is None
        or not (
            finding.place in places
            or finding.place in unknown
            or (finding.place in uncomputed and finding.code.startswith(MISNAMED))
            or (finding.place.file in halved and finding.code in UNNAMED)
        )
    )


def _check_top(source: Source, model: type[Model]) -> None:
    if isinstance(source.root, MappingNode) and source.root.entries:
        return
    required = [name for name, field in model.model_fields.items() if field.is_required()]
    given = "an empty file" if isinstance(source.root, MappingNode) else shown(source.root)
    message = f"expected a mapping with the keys {listed(required)}, not {given}"
    raise InvalidInput([source.finding(200, (), message)])


def _check_version(source: Source) -> None:
    """Refuses a file for a newer version, before its unknown keys are reported."""
    node = source.root.get("version") if isinstance(source.root, MappingNode) else None
    if not isinstance(node, ScalarNode) or not isinstance(node.value, str):
        return
    if re.fullmatch(r"\d{1,6}\.\d{1,6}\.\d{1,6}", node.value) and _numbers(node.value) > _numbers(__version__):
        message = f"this file needs manipcli >= {shorten(node.value)}; {__version__} is installed"
        hint = "update with: pip install --upgrade manipcli"
        raise InvalidInput([source.finding(213, ("version",), message, hint=hint)])


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version)[:3])
