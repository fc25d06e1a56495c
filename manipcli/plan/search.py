"""Choosing among a bounded list of candidates: the first that can be planned, or a reason for each that cannot."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BeforeValidator

from manipcli.core.errors import NotPlannable
from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.plan.motion import StepPlan
from manipcli.spec.base import problem
from manipcli.spec.quantity import Length

C = TypeVar("C")
REASONS = 3
"""How many reasons a refusal tells."""
_NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?")  # not the digits of a name


def _pair(value: object) -> object:
    """A single number stands for a range without width."""
    return value if isinstance(value, list | tuple) else (value, value)


def _rising(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        message = f"the least, {readable(bounds[0], 'm')}, is above the most, {readable(bounds[1], 'm')}"
        raise problem("range", message, hint="write [least, most]")
    if bounds[0] < 0.0:
        message = f"must be at least 0, not {readable(bounds[0], 'm')}"
        raise problem("range", message, hint="write [least, most], neither below 0, or one length")
    return bounds


Range = Annotated[
    tuple[Length, Length],
    BeforeValidator(_pair, json_schema_input_type=Length | tuple[Length, Length]),
    AfterValidator(_rising),
]
"""A range of lengths [least, most] [m], neither below 0, or one length."""


def spread(bounds: tuple[float, float]) -> tuple[float, ...]:
    """The middle of a range, then its ends; one value if it has no width."""
    low, high = bounds
    return (low,) if low == high else ((low + high) / 2, low, high)


def first_feasible(attempt: Callable[[C], StepPlan], candidates: Iterable[C], *, what: str) -> StepPlan:
    """The plan of the first candidate that has one.

    Raises:
        NotPlannable: none has; tells how many were tried and the commonest reasons, of which those that differ only in
            their numbers count as one and are told by their first. The hint is that of the commonest.
    """
    reasons: dict[str, list[NotPlannable]] = {}
    for candidate in candidates:
        try:
            return attempt(candidate)
        except NotPlannable as refusal:
            reasons.setdefault(_NUMBER.sub("#", refusal.cause), []).append(refusal)
    if not reasons:
        raise NotPlannable(f"{what}: there is nothing to try")
    commonest = sorted(reasons.values(), key=lambda refusals: -len(refusals))
    first, tried = commonest[0][0], sum(map(len, commonest))
    if tried == 1:
        raise NotPlannable(f"{what}: {first.cause}", hint=first.hint)
    told = "; ".join(f"{refusals[0].cause} ({len(refusals)} of {tried})" for refusals in commonest[:REASONS])
    more = len(commonest) - REASONS
    others = f"; and {number_of(more, 'other reason')}" if more > 0 else ""
    raise NotPlannable(f"{what}, {tried} ways tried: {told}{others}", hint=first.hint)
