"""Names of one task in the JSON Schema of task files, as lists that an editor completes."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final, cast

from manipcli.spec.names import MARK, NameKind
from manipcli.spec.source.tree import Plain

ANY_PARAMETER: Final = r"\$[A-Za-z_]"
"""Pattern of an expression with a parameter, as `schema` writes it."""
_ANY: Final = r"|\$"
"""The same at the end of the pattern of a quantity."""


@dataclass(frozen=True, slots=True)
class TaskNames:
    """The names that a task may use.

    Attributes:
        names: by kind; a kind that is missing is not known, and any name fits.
        params: of the task, and of its loops.
    """

    names: Mapping[NameKind, Collection[str]]
    params: Collection[str]

    @property
    def parameter(self) -> str:
        """Pattern of an expression with one of the parameters; `{name}` is inside a longer text."""
        known = "|".join(map(re.escape, sorted(self.params)))
        return rf"\$(?:{known})(?![A-Za-z0-9_])" if known else r"\$(?!.)\b"  # the last never fits


def list_names(node: Plain, names: TaskNames | None) -> None:
    """Replaces the marks of names in a schema, in place, by the names; without `names`, removes them."""
    if isinstance(node, list):
        for item in node:
            list_names(item, names)
    if not isinstance(node, dict):
        return
    kind = node.pop(MARK, None)
    if names is not None:
        _listed(node, cast(NameKind, kind), names)
        pattern = node.get("pattern")
        if isinstance(pattern, str):
            pattern = pattern.replace(ANY_PARAMETER, names.parameter)
            node["pattern"] = f"{pattern[: -len(_ANY)]}|{names.parameter}" if pattern.endswith(_ANY) else pattern
    for value in node.values():
        list_names(value, names)


def _listed(node: dict[str, Plain], kind: NameKind | None, names: TaskNames) -> None:
    known = None if kind is None else names.names.get(kind)
    if known is not None and node.get("type") == "string":
        listed: list[Plain] = [*sorted(known)]
        node["anyOf"] = [{"enum": listed}, {"pattern": ANY_PARAMETER}]
    keys = node.get("propertyNames")
    if isinstance(keys, dict) and MARK in keys:
        known = names.names.get(cast(NameKind, keys[MARK]))
        if known is not None:
            listed = [*sorted(known)]
            node["propertyNames"] = {"enum": listed}
