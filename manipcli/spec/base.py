"""Base model of all specs that users write: frozen, strict, unknown keys forbidden."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import cleandoc
from typing import ClassVar, Literal

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from manipcli.core.errors import Loc

Mistake = Literal["name", "range", "type", "count", "unit", "conflict", "verb", "duplicate"]
"""Kinds of mistakes that validators raise with `problem`; `spec/explain.py` lists their codes."""

_STRICT = frozenset({"float", "int", "bool", "str"})
_NO_SCHEMA = frozenset({"default", "metadata", "serialization", "cls", "function", "expected"})


def _make_strict(schema: object) -> None:
    if isinstance(schema, dict):
        kind = schema.get("type")  # a string in a schema; a dict of fields may have a field named `type`
        if isinstance(kind, str) and kind in _STRICT:
            schema["strict"] = True
        for key, value in schema.items():
            if key not in _NO_SCHEMA:
                _make_strict(value)
    elif isinstance(schema, list | tuple):
        for value in schema:
            _make_strict(value)


class Model(BaseModel):
    """A block of a user's file.

    Numbers, booleans and strings are strict: pydantic alone would read `true` as 1.0 and `"1.0"` as a number.
    An integer is still accepted as a float, and a list as a tuple.
    """

    renamed: ClassVar[Mapping[str, str]] = {}
    """Old key -> new key; an old key is refused, and the message names the new one."""

    model_config = ConfigDict(defer_build=True, frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: type[BaseModel], handler: GetCoreSchemaHandler, /) -> CoreSchema:
        schema = handler(source)
        _make_strict(schema)
        return schema


def about(spec: type[BaseModel]) -> str:
    """The first paragraph of the spec's docstring, on one line."""
    return " ".join(cleandoc(spec.__doc__ or "").partition("\n\n")[0].split())


def or_short(schema: CoreSchema, handler: GetJsonSchemaHandler, *short: JsonSchemaValue) -> JsonSchemaValue:
    """The JSON Schema of a model that a validator also reads from a short form.

    Args:
        schema, handler: arguments of `__get_pydantic_json_schema__`.
        short: schemas of the short forms.
    """
    whole = handler.resolve_ref_schema(handler(schema))
    long = dict(whole)
    whole.clear()
    whole |= {"description": long.pop("description", ""), "anyOf": [*short, long]}
    return whole


def problem(
    mistake: Mistake, message: str, *, at: Loc = (), hint: str | None = None, key: bool = False
) -> PydanticCustomError:
    """The error that a validator raises for an invalid block.

    Args:
        mistake: kind of mistake; selects the code.
        message: one sentence: what is wrong, what was expected.
        at: location inside the validated block.
        hint: what to do; the nearest name.
        key: point at the key that `at` names, not at its value.
    """
    context = {"message": message, "at": at, "hint": hint or "", "key": key}
    return PydanticCustomError(mistake, "{message}", context)
