"""A validated file with the places of everything in it, so that later stages can point at what they refuse."""

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
from manipcli.spec.explain import explain
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

M = TypeVar("M", bound=Model)

Area = Literal["TASK", "ROBOT", "CTRL"]

UNCOMPUTED: Final = ("TASK203", "TASK211")
"""An expression that has no value. That its text is no name either (`MISNAMED`) needs no second telling."""
MISNAMED: Final = "TASK23"
TWICE: Final = "YAML106"
"""A key that stands twice: what the second holds is left out, which may be what other lines name (`UNNAMED`)."""
UNNAMED: Final = ("TASK225", "TASK227", "TASK230")


@dataclass(frozen=True, slots=True)
class Source:
    """A file's tree, after parameters and overrides, and what it is called.

    `kept`: where items of a list were left out, the indices in the file of those that remain, by the list's key.
    `whole`: where anything was left out or replaced, the tree before that.
    `unknown`: the values that are not known, since what they are computed from has been refused.
    """

    name: str
    root: Node
    area: Area
    kept: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    whole: Node | None = None
    unknown: frozenset[Place] = frozenset()

    def plain(self) -> Plain:
        """The data alone."""
        return plain(self.root)

    def untouched(self, *path: str) -> bool:
        """Whether nothing at or below `path` was left out or replaced."""
        before: Node | None = self.whole
        now: Node | None = self.root
        for part in path if before is not None else ():
            before, now = before and child(before, part), now and child(now, part)
        return self.whole is None or before is now

    def place(self, *path: str | int) -> Place:
        """Where the value at `path` stands; of what is not written, the nearest block around it."""
        return node_at(self.root, path).place

    def key_place(self, *path: str | int) -> Place:
        """Where the key at `path` stands."""
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
        """Something to tell about the value (or, with `key`, the key) at `path`, under this kind of file's code."""
        place = self.key_place(*path) if key else self.place(*path)
        where = f"{dotted(self._in_file(path))}: " if path else ""
        return Diagnostic(f"{self.area}{number}", f"{where}{message}", place, hint=hint, severity=severity)

    def _in_file(self, path: Loc) -> Loc:
        if len(path) > 1 and isinstance(path[0], str) and isinstance(path[1], int) and path[0] in self.kept:
            return (path[0], self.kept[path[0]][path[1]], *path[2:])
        return path


@dataclass(frozen=True, slots=True)
class Located(Generic[M]):
    """A validated spec and its source. `findings` are warnings and notes: errors do not get here."""

    spec: M
    source: Source
    findings: tuple[Diagnostic, ...] = ()

    def place(self, *path: str | int) -> Place:
        """`place("scene", "cup", "mass")`, `place("steps", 3, "move", "to")`."""
        return self.source.place(*path)


def validate(source: Source, model: type[M], *, findings: Sequence[Diagnostic]) -> Located[M]:
    """The spec that the source says.

    Args:
        source: the tree.
        model: what it should be.
        findings: what is known against the file already; errors among them are raised together with the model's.

    Raises:
        InvalidInput: with every finding.
    """
    told = apart(findings, source.unknown)
    if not any(finding.code.startswith("YAML") for finding in told):
        _check_top(source, model)
    _check_version(source)
    try:
        spec = model.model_validate(plain(source.root))
    except ValidationError as error:
        # A text whose expression failed stays in the tree; that it is no quantity either needs no second telling.
        places = {finding.place for finding in told if finding.severity == "error"} | source.unknown
        more = [f for f in explain(error, source.root, model, source.area) if f.place not in places]
        raise InvalidInput([*told, *more]) from None
    except RecursionError:
        raise InvalidInput([*told, source.finding(205, (), "nested too deep")]) from None
    if any(finding.severity == "error" for finding in told):
        raise InvalidInput(told)
    return Located(spec, source, told)


def apart(findings: Sequence[Diagnostic], unknown: AbstractSet[Place]) -> tuple[Diagnostic, ...]:
    """Without what would not be, had the text of the file been right, or were the values known that are `unknown`."""
    places = {one.place for one in findings if one.code.startswith("YAML")}
    uncomputed = {one.place for one in findings if one.code in UNCOMPUTED}
    halved = {one.place.file for one in findings if one.code == TWICE and one.place is not None}
    return tuple(
        one
        for one in findings
        if one.code.startswith("YAML")
        or one.place is None
        or not (
            one.place in places
            or one.place in unknown
            or (one.place in uncomputed and one.code.startswith(MISNAMED))
            or (one.place.file in halved and one.code in UNNAMED)
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
    """A newer file may have keys that this version does not know: that alone is told then."""
    node = source.root.get("version") if isinstance(source.root, MappingNode) else None
    if not isinstance(node, ScalarNode) or not isinstance(node.value, str):
        return
    if re.fullmatch(r"\d{1,6}\.\d{1,6}\.\d{1,6}", node.value) and _numbers(node.value) > _numbers(__version__):
        message = f"this file needs manipcli >= {shorten(node.value)}; this is {__version__}"
        hint = "update with: pip install --upgrade manipcli"
        raise InvalidInput([source.finding(213, ("version",), message, hint=hint)])


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", version)[:3])
