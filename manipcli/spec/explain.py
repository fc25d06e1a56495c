"""Diagnostics from pydantic's errors: place, given value, expected value, nearest name.

A code is the kind of file (`TASK`, `ROBOT`, `CTRL`) and a number that does not change:

| number | mistake |
|---|---|
| 200 | the file is empty, or its top level is not a mapping |
| 201 | an unknown key |
| 202 | a key is missing |
| 203 | an unknown name, verb, condition or parameter |
| 204 | out of range |
| 205 | a value of the wrong type |
| 206 | too many or too few items |
| 207 | a quantity without a unit, or with a wrong unit |
| 208 | keys or values that contradict each other |
| 209 | a step without a verb or with several verbs; likewise a condition |
| 210 | a duplicate name, id or joint |
| 211 | an expression (`2 * $tilt + 5 deg`) that cannot be computed |
| 212 | an override (`--set a.b=value`) whose path does not exist |
| 213 | the file needs a newer manipcli |
| 214 | a ROS feature that manipcli does not support (warning) |
| 215 | a ROS controller that starts inactive, since another commands the same joint (note) |
| 216 | an integral gain that has no effect in ROS 1 (warning) |
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.text import any_of, did_you_mean, listed, nearest
from manipcli.core.units import ANGLE, readable
from manipcli.spec import hints
from manipcli.spec.block_fields import unit_of
from manipcli.spec.quantity import Unit
from manipcli.spec.source import shape
from manipcli.spec.source.tree import (
    MappingNode,
    Node,
    ScalarNode,
    SequenceNode,
    child,
    dotted,
    key_place_at,
    node_at,
    shown,
)

_MISTAKES = {
    "name": 203, "range": 204, "type": 205, "count": 206, "unit": 207, "conflict": 208, "verb": 209, "duplicate": 210,
    "missing": 202, "extra_forbidden": 201, "literal_error": 203, "value_error": 208, "assertion_error": 208,
    "quantity_type": 205, "too_short": 206, "too_long": 206, "string_too_short": 206, "string_too_long": 206,
    "greater_than": 204, "greater_than_equal": 204, "less_than": 204, "less_than_equal": 204, "multiple_of": 204,
    "finite_number": 204, "union_tag_invalid": 203, "union_tag_not_found": 202,
}  # fmt: skip
_EXPECTED = {
    "float_type": "a number", "int_type": "a whole number", "bool_type": "true or false", "string_type": "a string",
    "tuple_type": "a list", "list_type": "a list", "dict_type": "a mapping", "model_type": "a mapping",
    "model_attributes_type": "a mapping", "mapping_type": "a mapping", "set_type": "a list",
    "frozen_set_type": "a list", "none_required": "no value", "int_from_float": "a whole number",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Complaint:
    """One pydantic error located in the tree. `tags`: the branch that a union took, by depth."""

    error: ErrorDetails
    path: Loc
    tags: tuple[tuple[int, str], ...]
    used: int = 0

    @property
    def open_tag(self) -> tuple[int, str] | None:
        """The outermost undecided branch."""
        return self.tags[self.used] if self.used < len(self.tags) else None

    def mismatch(self, depth: int) -> bool:
        """Whether the value does not fit the branch at `depth` at all."""
        return len(self.path) == depth and (self.error["type"] in _EXPECTED or self.error["type"] in _WHOLE)


_WHOLE = frozenset({"literal_error", "quantity_type", "unit"})


def explain(
    error: ValidationError,
    root: Node,
    model: type[BaseModel],
    area: str,
    *,
    in_file: Callable[[Loc], Loc] = lambda path: path,
) -> tuple[Diagnostic, ...]:
    """All errors as diagnostics, in the order of the file; `in_file` gives a path of the tree as it is in the file."""
    complaints = [_locate(details, root) for details in error.errors(include_url=False)]
    findings: list[Diagnostic] = []
    for complaint in _decide(_without_renamed(_counted(complaints), root), root):
        findings.append(_finding(complaint[0], complaint, root, model, area, in_file))
    return tuple(
        sorted(distinct(findings), key=lambda f: (f.place.line, f.place.column) if f.place is not None else (0, 0))
    )


def distinct(findings: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The findings without those that repeat code, place and message, as in the rounds of a `repeat`."""
    first: dict[tuple[str, Place | None, str], Diagnostic] = {}
    for finding in findings:
        first.setdefault((finding.code, finding.place, finding.message), finding)
    return tuple(first.values())


def with_origin(hint: str | None, node: Node) -> str | None:
    """The hint, and where the value of a local parameter in this scalar is given."""
    if not isinstance(node, ScalarNode) or node.given is None:
        return hint
    origin = f"the value comes from '{node.written}'; it is given at {node.given}"
    return f"{hint}; {origin}" if hint else origin


def _locate(error: ErrorDetails, root: Node) -> _Complaint:
    """Walks the location down the tree; a part that is not in the tree is pydantic's name of a union branch."""
    path: Loc = ()
    tags: list[tuple[int, str]] = []
    loc = error["loc"]
    node: Node | None = root
    for index, part in enumerate(loc):
        below = child(node, part) if node is not None else None
        last = index == len(loc) - 1
        if below is not None:
            path, node = (*path, part), below
        elif last and error["type"] in ("missing", "extra_forbidden"):
            path = (*path, part)
        elif part != "[key]":
            tags.append((len(path), str(part)))
    context = error.get("ctx", {})
    return _Complaint(error, (*path, *context.get("at", ())), tuple(tags))


def _counted(complaints: Sequence[_Complaint]) -> list[_Complaint]:
    """Merges the missing items of a fixed-length list into one complaint about its length."""
    result: list[_Complaint] = []
    longest: dict[tuple[Loc, tuple[tuple[int, str], ...]], int] = {}
    for complaint in complaints:
        last = complaint.path[-1] if complaint.path else None
        if complaint.error["type"] == "missing" and isinstance(last, int):
            key = (complaint.path[:-1], complaint.tags)
            if key not in longest:
                result.append(replace(complaint, path=complaint.path[:-1]))
            longest[key] = last + 1
        else:
            result.append(complaint)
    # A wrong item is not counted; the count needs no second message.
    wrong = {complaint.path[:depth] for complaint in result for depth in range(len(complaint.path))}
    result = [
        complaint for complaint in result if complaint.error["type"] != "too_short" or complaint.path not in wrong
    ]
    for index, complaint in enumerate(result):
        wanted = longest.get((complaint.path, complaint.tags))
        if wanted is not None and complaint.error["type"] == "missing":
            details = complaint.error.copy()
            details["type"], details["ctx"] = "too_short", {"min_length": wanted, "exact": True}
            result[index] = replace(complaint, error=details)
    return result


def _without_renamed(complaints: list[_Complaint], root: Node) -> list[_Complaint]:
    """Without a missing key that a misspelt one stands for: a similar one, or where no key of the block is known."""
    unknown: dict[tuple[Loc, tuple[tuple[int, str], ...]], list[str]] = {}
    for complaint in complaints:
        if complaint.error["type"] == "extra_forbidden":
            unknown.setdefault((complaint.path[:-1], complaint.tags), []).append(str(complaint.path[-1]))

    def renamed(complaint: _Complaint) -> bool:
        given = unknown.get((complaint.path[:-1], complaint.tags), [])
        block = node_at(root, complaint.path[:-1])
        all_unknown = isinstance(block, MappingNode) and len(given) == len(block.entries)
        return bool(given) and (all_unknown or any(nearest(key, [str(complaint.path[-1])]) for key in given))

    return [complaint for complaint in complaints if complaint.error["type"] != "missing" or not renamed(complaint)]


def _decide(complaints: Sequence[_Complaint], root: Node) -> list[list[_Complaint]]:
    """Keeps the best matching branch of each union; if none matches, its branches become one complaint."""
    decided: list[list[_Complaint]] = []
    unions: dict[tuple[int, Loc], list[_Complaint]] = {}
    for complaint in complaints:
        tag = complaint.open_tag
        if tag is None:
            decided.append([complaint])
        else:
            unions.setdefault((tag[0], complaint.path[: tag[0]]), []).append(complaint)
    for (depth, _), group in unions.items():
        branches: dict[str, list[_Complaint]] = {}
        for complaint in group:
            tag = complaint.open_tag
            if tag is not None:
                branches.setdefault(tag[1], []).append(replace(complaint, used=complaint.used + 1))
        meant = [branch for branch in branches.values() if not all(c.mismatch(depth) for c in branch)]
        if meant:
            decided.extend(_decide(min(meant, key=_badness), root))
        elif len(branches) == 1:
            decided.extend(_decide(next(iter(branches.values())), root))
        else:
            decided.append([complaint for branch in branches.values() for complaint in branch])
    return decided


def _badness(branch: Sequence[_Complaint]) -> tuple[int, int]:
    strange = sum(1 for c in branch if c.error["type"] in ("extra_forbidden", "missing"))
    return strange, len(branch)


def _finding(
    first: _Complaint,
    branches: Sequence[_Complaint],
    root: Node,
    model: type[BaseModel],
    area: str,
    in_file: Callable[[Loc], Loc],
) -> Diagnostic:
    kind, path = first.error["type"], first.path
    node = node_at(root, path)
    what, hint = _message(first, branches, root, model)
    at_key = kind == "extra_forbidden" or bool(first.error.get("ctx", {}).get("key", False))
    origin = None if at_key else _origin(node, root)
    if (kind in _RANGES or kind == "unit") and hint is not None and origin is not None:
        hint = f"{hint}; {origin}"
    elif hint is None:
        hint = origin
    place = key_place_at(root, path) if at_key else node.place
    where = dotted(in_file(path[:-1] if kind in ("extra_forbidden", "missing") or at_key else path))
    code = f"{area}{_MISTAKES.get(kind, 205)}"
    return Diagnostic(code, f"{where}: {what}" if where else what, place, hint=hint)


def _origin(node: Node, root: Node) -> str | None:
    """The parameter that a value comes from, and its place."""
    if isinstance(node, ScalarNode) and node.given is not None:
        return with_origin(None, node)
    written = node.written if isinstance(node, ScalarNode) else None
    for name in re.findall(r"\$\{?(\w+)", written or ""):
        declared = child(child(root, "params") or root, name)
        if declared is not None:
            return f"the value comes from '{written}'; params.{name} is at {declared.place}"
    return None


def _message(
    first: _Complaint, branches: Sequence[_Complaint], root: Node, model: type[BaseModel]
) -> tuple[str, str | None]:
    """The message and the hint."""
    kind, path, context = first.error["type"], first.path, first.error.get("ctx", {})
    node = node_at(root, path)
    if len(branches) > 1:
        around = {depth: tag for depth, tag in first.tags if depth < len(path)}
        return _no_match(branches, node, shape.at(model, path, around))
    if kind == "extra_forbidden":
        return f"unknown key '{dotted((path[-1],))}'", hints.unknown_key(path, dict(first.tags), model)
    if kind == "missing":
        then = child(node_at(root, path[:-1]), "then") if path[-2:] == ("on_fail", "retry") else None
        hint = _described(_field(first, model), path)
        if isinstance(then, ScalarNode):
            hint = f"without a retry write `on_fail: {then.value}`"
        return f"the key '{path[-1]}' is missing", hint
    if "message" in context:
        hint = str(context.get("hint", "")) or None
        return str(context["message"]), hint or (_described(_field(first, model), path) if kind == "unit" else None)
    if kind == "literal_error":
        what, hint = _unknown_word(str(context.get("expected", "")), node)
        return what, hint or _described(_field(first, model), path)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _unknown_type(context, node)
    if kind in ("too_short", "too_long"):
        return _wrong_count(
            context, node, exact=shape.is_of_fixed_length(shape.at(model, path, dict(first.tags)))
        ), None
    if kind in _RANGES:
        field = _field(first, model)
        unit = _unit(first, model)
        hint = hints.other_unit(unit, context, node) or _described(field, path)
        return f"must be {_RANGES[kind]} {_limit(context, unit)}, not {shown(node)}", hint
    if kind in ("value_error", "assertion_error"):
        return str(context.get("error", first.error["msg"])), None
    if kind == "none_required":
        return f"expected no value, not {shown(node)}", _described(_field(first, model), path)
    expected = _expected(first)
    kinds = shape.at(model, path, dict(first.tags))
    hint = hints.of_type(kind, node, kinds, item=isinstance(path[-1], int))
    if hint is None and kind in ("model_type", "model_attributes_type"):
        hint = hints.to_write(kinds)
    hint = hint or _described(_field(first, model), path)
    return f"expected {expected}, not {shown(node)}" if expected else first.error["msg"], hint


_RANGES = {
    "greater_than": "more than", "greater_than_equal": "at least", "less_than": "less than",
    "less_than_equal": "at most", "multiple_of": "a multiple of",
}  # fmt: skip


def _field(complaint: _Complaint, model: type[BaseModel]) -> FieldInfo | None:
    """The field of the key; None for a list item and for a user-defined name."""
    *above, key = complaint.path or ("",)
    return shape.keys_of(shape.at(model, tuple(above), dict(complaint.tags))).get(str(key))


def _described(field: FieldInfo | None, path: Loc) -> str | None:
    return None if field is None or not field.description else f"{path[-1]}: {field.description}"


def _limit(context: dict[str, object], unit: Unit | None) -> str:
    """A bound with its unit: `180 deg`, `3600 s`."""
    value = next((context[key] for key in ("gt", "ge", "lt", "le", "multiple_of") if key in context), "")
    if not isinstance(value, int | float):
        return str(value)
    if not value or unit is None:
        return f"{value:g}"
    symbols = " or ".join(dimension.symbol for dimension in unit.dimensions)
    return readable(value, "rad") if unit.dimensions == (ANGLE,) else f"{value:g} {symbols}".rstrip()


def _unit(complaint: _Complaint, model: type[BaseModel]) -> Unit | None:
    """Unit of the expected quantity, also for list items."""
    path, tags = complaint.path, dict(complaint.tags)
    key = max((k for k, part in enumerate(path) if isinstance(part, str)), default=None)
    if key is None:
        return None
    field = shape.keys_of(shape.at(model, path[:key], tags)).get(str(path[key]))
    return None if field is None else unit_of(field.annotation, field.metadata)


def _expected(complaint: _Complaint) -> str:
    error = complaint.error
    context = error.get("ctx", {})
    if error["type"] == "literal_error":
        return f"one of {context.get('expected', '')}"
    if error["type"] == "unit":
        return str(context.get("message", "")).partition("expected ")[2] or "a quantity"
    return str(context.get("expected") or _EXPECTED.get(error["type"], ""))


def _no_match(branches: Sequence[_Complaint], node: Node, kinds: Sequence[object]) -> tuple[str, str | None]:
    wanted = list(dict.fromkeys(expected for expected in map(_expected, branches) if expected))
    alternatives = wanted[0] if len(wanted) == 1 else f"{', '.join(wanted[:-1])}, or {wanted[-1]}"
    given = (str(branch.error.get("ctx", {}).get("hint", "")) for branch in branches)
    hint = hints.its_key(node, kinds) or next(filter(None, given), None)
    if hint is None and any(branch.error["type"] == "bool_type" for branch in branches):
        hint = hints.of_type("bool_type", node, kinds, item=False)
    return f"expected {alternatives}, not {shown(node)}", hint


def _unknown_word(expected: str, node: Node) -> tuple[str, str | None]:
    words = [word.strip("'") for word in expected.replace(" or ", ", ").split(", ")]
    value = node.value if isinstance(node, ScalarNode) else None
    close = nearest(value, words) if isinstance(value, str) else ()
    wanted = f"one of {expected}" if len(words) > 1 else expected
    return f"expected {wanted}, not {shown(node)}", f"did you mean {any_of(close)}?" if close else None


def _unknown_type(context: dict[str, object], node: Node) -> tuple[str, str | None]:
    key = str(context.get("discriminator", "")).strip("'")
    if "expected_tags" not in context:
        return f"the key '{key}' is missing: it selects the type", None
    tags = [tag.strip(" '") for tag in str(context["expected_tags"]).split(",")]
    given = str(context.get("tag", ""))
    hint = did_you_mean(given, tags, kind="known")
    return f"unknown {key} '{dotted((given,))}', expected one of {listed(tags)}", hint


def _wrong_count(context: dict[str, object], node: Node, *, exact: bool) -> str:
    items = node.items if isinstance(node, SequenceNode) else node.entries if isinstance(node, MappingNode) else ()
    given = len(items)
    if "min_length" in context:
        exactly = "" if exact or context.get("exact") else "at least "
        return f"expected {exactly}{_items(context['min_length'])}, got {given}"
    return f"expected {'' if exact else 'at most '}{_items(context.get('max_length'))}, got {given}"


def _items(number: object) -> str:
    return "1 item" if number == 1 else f"{number} items"
