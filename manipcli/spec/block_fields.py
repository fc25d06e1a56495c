"""Values of a validated block with their field types, bounds and units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from manipcli.spec.quantity import Unit

Held = tuple[object, object, Sequence[object]]
"""A value, and the annotation and metadata of its field."""


def children(value: object, annotation: object) -> dict[str, Held]:
    """Children of a value, by key or index; items have the annotation of their list or mapping."""
    if isinstance(value, BaseModel):
        return {
            field.alias or name: (getattr(value, name), field.annotation, field.metadata)
            for name, field in type(value).model_fields.items()
        }
    if isinstance(value, dict):
        return {str(name): (item, annotation, ()) for name, item in value.items()}
    if isinstance(value, tuple):
        return {str(k): (item, annotation, ()) for k, item in enumerate(value)}
    return {}


def bounds_of(annotation: object, metadata: Sequence[object]) -> tuple[float, float]:
    """Lower and upper bound of a field's type, searched recursively; infinite without bounds."""
    least, most = -math.inf, math.inf
    for item in (*metadata, *getattr(annotation, "__metadata__", ())):
        for stated in item.metadata if isinstance(item, FieldInfo) else (item,):
            match stated:
                case Gt(gt=int() | float() as bound) | Ge(ge=int() | float() as bound):
                    least = max(least, bound)
                case Lt(lt=int() | float() as bound) | Le(le=int() | float() as bound):
                    most = min(most, bound)
    if (least, most) != (-math.inf, math.inf) or get_origin(annotation) is None:
        return least, most
    deeper = (bounds_of(part, ()) for part in get_args(annotation))
    return next((bounds for bounds in deeper if bounds != (-math.inf, math.inf)), (least, most))


def unit_of(annotation: object, metadata: Sequence[object]) -> Unit | None:
    """Unit of a field's type, searched recursively; None without a unit."""
    for item in (*metadata, *getattr(annotation, "__metadata__", ())):
        if isinstance(item, Unit):
            return item
    if get_origin(annotation) is None:
        return None
    units = (unit_of(part, ()) for part in get_args(annotation))
    return next((unit for unit in units if unit is not None), None)
