"""The base of everything that users write: frozen, unknown keys forbidden, nothing converted that was not meant."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import cleandoc
from typing import ClassVar, Literal

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from manipcli.core.errors import Loc

Mistake = Literal["name", "range", "type", "count", "unit", "conflict", "verb", "duplicate"]
"""Kinds of mistakes that validators tell with `problem`; the codes stand in `spec/explain.py`."""

_STRICT = frozenset({"float", "int", "bool", "str"})
_NO_SCHEMA = frozenset({"default", "metadata", "serialization", "cls", "function", "expected"})


def _make_strict(schema: object) -> None:
    if isinstance(schema, dict):
        kind = schema.get("type")  # of a schema; a dict of fields may have a field called `type`
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

    Its numbers, truth values and texts are strict: pydantic alone would read `true` as 1.0 and `"1.0"` as a number.
    A whole number is still a float where one is wanted, and a list is a tuple.
    """

    renamed: ClassVar[Mapping[str, str]] = {}
    """Keys of earlier versions, which are refused, and their names now."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def __get_pydantic_core_schema__(cls, source: type[BaseModel], handler: GetCoreSchemaHandler, /) -> CoreSchema:
        schema = handler(source)
        _make_strict(schema)
        return schema


def about(spec: type[BaseModel]) -> str:
    """The first paragraph of its docstring, in one line."""
    return " ".join(cleandoc(spec.__doc__ or "").partition("\n\n")[0].split())


def or_short(schema: CoreSchema, handler: GetJsonSchemaHandler, *short: JsonSchemaValue) -> JsonSchemaValue:
    """The JSON Schema of a model of which a validator reads something `short`, too.

    Args:
        schema, handler: of `__get_pydantic_json_schema__`.
        short: schemas of what may stand in the place of the whole block.
    """
    whole = handler.resolve_ref_schema(handler(schema))
    long = dict(whole)
    whole.clear()
    whole |= {"description": long.pop("description", ""), "anyOf": [*short, long]}
    return whole


def problem(
    mistake: Mistake, message: str, *, at: Loc = (), hint: str | None = None, key: bool = False
) -> PydanticCustomError:
    """What a validator raises when a block cannot be meant.

    Args:
        mistake: the kind, which decides the code.
        message: one sentence: what is wrong, what was expected.
        at: where inside the validated block.
        hint: what to do; the nearest name.
        key: point at the key that `at` names, not at its value.
    """
    context = {"message": message, "at": at, "hint": hint or "", "key": key}
    return PydanticCustomError(mistake, "{message}", context)
