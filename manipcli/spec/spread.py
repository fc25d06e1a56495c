"""Conditions over a selection, as they are written and in full: `of` is the `object` of the condition.

at_least: {n: 18, of: 'ball[*]', inside: tray}                       # as written
at_least: {n: 18, of: 'ball[*]', inside: {object: 'ball[*]', of: tray}}       # in full
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from pydantic import create_model

from manipcli.spec.base import Model, problem
from manipcli.spec.condition import COMBINATIONS, SELECTING

OBJECT: Final = "object"
SHORT: Final = 1
"""Other required fields of a condition up to which its mapping may be left out: `inside: tray`."""


def takes_object(spec: type[Model]) -> bool:
    """Whether a condition is about an `object`."""
    return OBJECT in spec.model_fields


def short_field(spec: type[Model]) -> str | None:
    """The only required field of a condition besides its `object`, whose value may stand for the condition."""
    required = [name for name, field in spec.model_fields.items() if field.is_required() and name != OBJECT]
    return required[0] if takes_object(spec) and len(required) == SHORT else None


def written_as(spec: type[Model]) -> object:
    """The type of what may be written for a condition under `of`: all of it, or without its `object`."""
    if not takes_object(spec):
        return spec
    others = {name: (field.annotation, field) for name, field in spec.model_fields.items() if name != OBJECT}
    # The field names are only known at run time: no overload of create_model fits.
    rest = create_model(f"{spec.__name__}OfEach", __base__=Model, __doc__=spec.__doc__, **others)  # type: ignore[call-overload]
    short = short_field(spec)
    if short is not None:
        return spec | rest | spec.model_fields[short].annotation
    return spec | rest if any(field.is_required() for _, field in others.values()) else spec | rest | None


def spread(word: str, specs: Mapping[str, type[Model]]) -> Callable[[object], object]:
    """Validator of what is written under `all_of`, `any_of` or `at_least`: puts `of` into its condition.

    Args:
        word: which of the three.
        specs: of all conditions, by name.
    """

    def written(value: object) -> object:
        if not isinstance(value, dict):
            return value
        if word == "at_least" and "n" not in value:
            raise problem("verb", "`at_least` needs `n`, the number of bodies", hint="write `n: 1` or more")
        if word != "at_least" and "n" in value:
            message = f"`{word}` takes no `n`"
            raise problem("conflict", message, at=("n",), key=True, hint="write `at_least: {n: ..., ...}`")
        return _filled(value, value["of"], specs) if isinstance(value.get("of"), str) else value

    return written


def _filled(value: Mapping[object, object], of: str, specs: Mapping[str, type[Model]]) -> dict[object, object]:
    """A mapping with conditions, each with its object."""
    return {key: _given(key, held, of, specs) for key, held in value.items()}


def _given(key: object, held: object, of: str, specs: Mapping[str, type[Model]]) -> object:
    if key in COMBINATIONS and key not in SELECTING:
        items = held if isinstance(held, list) else [held]
        filled = [_filled(item, of, specs) if isinstance(item, dict) else item for item in items]
        return filled if isinstance(held, list) else filled[0]
    spec = specs.get(str(key))
    if spec is None or isinstance(held, Model):
        return held
    if not takes_object(spec):
        message = f"`{key}` has no `object` that `of` could be"
        raise problem("conflict", message, at=("of",), key=True, hint=f"leave `of` out and write '{of}' in `{key}`")
    if isinstance(held, dict):
        if held.get(OBJECT, of) != of:
            message = f"both `of: '{of}'` and `object: '{held[OBJECT]}'`"
            raise problem("conflict", message, at=(str(key), OBJECT), key=True, hint="leave one of them out")
        return {OBJECT: of, **held}
    short = short_field(spec)
    if held is None:
        return {OBJECT: of}
    return held if short is None else {OBJECT: of, short: held}
