"""Choosing among a bounded list of candidates: the first that can be planned, or a reason for each that cannot."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from typing import Annotated, TypeVar

from pydantic import BeforeValidator

from manipcli.core.errors import NotPlannable
from manipcli.plan.step import StepPlan
from manipcli.spec.quantity import Length

C = TypeVar("C")


def _pair(value: object) -> object:
    """A single number stands for a range without width."""
    return value if isinstance(value, list | tuple) else (value, value)


Range = Annotated[tuple[Length, Length], BeforeValidator(_pair)]
"""A range of lengths [least, most] [m], or one length."""


def spread(bounds: tuple[float, float]) -> tuple[float, ...]:
    """The middle of a range, then its ends; one value if it has no width."""
    low, high = bounds
    return (low,) if low == high else ((low + high) / 2, low, high)


def first_feasible(attempt: Callable[[C], StepPlan], candidates: Iterable[C], *, what: str) -> StepPlan:
    """The plan of the first candidate that has one.

    Raises:
        NotPlannable: none has; names what was tried, and the distinct reasons, the commonest first.
    """
    reasons: dict[str, int] = {}
    for candidate in candidates:
        try:
            return attempt(candidate)
        except NotPlannable as refusal:
            reasons[refusal.cause] = reasons.get(refusal.cause, 0) + 1
    tried = sum(reasons.values())
    listed = sorted(reasons.items(), key=lambda item: -item[1])
    told = "; ".join(f"{cause} ({count} of {tried})" for cause, count in itertools.islice(listed, 3))
    raise NotPlannable(f"{what}: {told}")
