"""What stands in a validated block, with the types that say what it may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args, get_origin

from pydantic import BaseModel

from manipcli.spec.quantity import Unit

Held = tuple[object, object, Sequence[object]]
"""A value, and the annotation and metadata of the field that it stands in."""


def children(value: object, annotation: object) -> dict[str, Held]:
    """What stands directly below a value, by key or index; items have the annotation of their list or mapping."""
    if isinstance(value, BaseModel):
        return {
            field.alias or name: (getattr(value, name), field.annotation, field.metadata)
            for name, field in type(value).model_fields.items()
        }
    if isinstance(value, dict):
        return {str(name): (one, annotation, ()) for name, one in value.items()}
    if isinstance(value, tuple):
        return {str(k): (one, annotation, ()) for k, one in enumerate(value)}
    return {}


def unit_of(annotation: object, metadata: Sequence[object]) -> Unit | None:
    """The unit that a field's type states, however deep in it."""
    for one in (*metadata, *getattr(annotation, "__metadata__", ())):
        if isinstance(one, Unit):
            return one
    if get_origin(annotation) is None:
        return None
    units = (unit_of(one, ()) for one in get_args(annotation))
    return next((unit for unit in units if unit is not None), None)
