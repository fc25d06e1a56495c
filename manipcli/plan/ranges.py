"""Ranges of lengths in a step, whose values are tried in order."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, BeforeValidator

from manipcli.core.units import readable
from manipcli.spec.base import problem
from manipcli.spec.quantity import Length


def _pair(value: object) -> object:
    """A single number is a range without width."""
    return value if isinstance(value, list | tuple) else (value, value)


def _rising(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        message = f"minimum {readable(bounds[0], 'm')} is above maximum {readable(bounds[1], 'm')}"
        raise problem("range", message, hint="write [minimum, maximum]")
    if bounds[0] < 0.0:
        message = f"must be at least 0, not {readable(bounds[0], 'm')}"
        raise problem("range", message, hint="write [minimum, maximum], both 0 or more, or one length")
    return bounds


Range = Annotated[
    tuple[Length, Length],
    BeforeValidator(_pair, json_schema_input_type=Length | tuple[Length, Length]),
    AfterValidator(_rising),
]
"""A range of lengths [minimum, maximum] [m], both 0 or more, or one length."""


def spread(bounds: tuple[float, float]) -> tuple[float, ...]:
    """The middle of a range, then its ends; a single value for a range without width."""
    low, high = bounds
    return (low,) if low == high else ((low + high) / 2, low, high)
