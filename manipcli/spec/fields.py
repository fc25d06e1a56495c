"""What stands in a validated block, with the types that say what it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

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


def bounds_of(annotation: object, metadata: Sequence[object]) -> tuple[float, float]:
    """The least and the most number that a field's type states, however deep in it; infinite where it states none."""
    least, most = -math.inf, math.inf
    for one in (*metadata, *getattr(annotation, "__metadata__", ())):
        for stated in one.metadata if isinstance(one, FieldInfo) else (one,):
            match stated:
                case Gt(gt=int() | float() as bound) | Ge(ge=int() | float() as bound):
                    least = max(least, bound)
                case Lt(lt=int() | float() as bound) | Le(le=int() | float() as bound):
                    most = min(most, bound)
    if (least, most) != (-math.inf, math.inf) or get_origin(annotation) is None:
        return least, most
    deeper = (bounds_of(one, ()) for one in get_args(annotation))
    return next((one for one in deeper if one != (-math.inf, math.inf)), (least, most))


def unit_of(annotation: object, metadata: Sequence[object]) -> Unit | None:
    """The unit that a field's type states, however deep in it."""
    for one in (*metadata, *getattr(annotation, "__metadata__", ())):
        if isinstance(one, Unit):
            return one
    if get_origin(annotation) is None:
        return None
    units = (unit_of(one, ()) for one in get_args(annotation))
    return next((unit for unit in units if unit is not None), None)
