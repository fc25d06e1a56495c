"""Search over a bounded list of candidates: the plan of the first feasible one, or the reasons of all failures."""

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
"""Number of reasons that a refusal lists."""
_NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?")  # not digits in a name


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


def first_feasible(attempt: Callable[[C], StepPlan], candidates: Iterable[C], *, what: str) -> StepPlan:
    """The plan of the first candidate that has one.

    Raises:
        NotPlannable: no candidate has one; names how many failed and the commonest reasons. Reasons that differ only in
            their numbers are grouped, and the first is shown. The hint is that of the commonest reason.
    """
    reasons: dict[str, list[NotPlannable]] = {}
    for candidate in candidates:
        try:
            return attempt(candidate)
        except NotPlannable as refusal:
            reasons.setdefault(_NUMBER.sub("#", refusal.cause), []).append(refusal)
    if not reasons:
        raise NotPlannable(f"{what}: there is no candidate")
    commonest = sorted(reasons.values(), key=lambda refusals: -len(refusals))
    first, tried = commonest[0][0], sum(map(len, commonest))
    if tried == 1:
        raise NotPlannable(f"{what}: {first.cause}", hint=first.hint)
    shown = "; ".join(f"{refusals[0].cause} ({len(refusals)} of {tried})" for refusals in commonest[:REASONS])
    more = len(commonest) - REASONS
    others = f"; and {number_of(more, 'other reason')}" if more > 0 else ""
    raise NotPlannable(f"{what}, all {tried} candidates failed: {shown}{others}", hint=first.hint)
