"""Candidates of a step: the ways to do it, the preferred first, and what refused each of them."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.plan.motion import StepPlan

Decision = Literal["nothing", "grasp", "place", "branch"]
"""What later steps depend on: how an object is held, where it is put, or the configuration of the arm."""

REASONS: Final = 3
"""Number of reasons that a refusal lists."""
OTHER: Final = math.radians(40.0)
"""[rad] Grasps that differ by less count as the same: where one of them fails, the other is likely to fail."""
NUMBER: Final = re.compile(r"(?<![\w.])-?\d+(\.\d+)?")
"""A number in a cause, but no digits in a name."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to do a step.

    Attributes:
        plan: its plan; raises NotPlannable.
        name: in reports; "" for the only way.
        grasp: R_WT (3, 3) of the tool when the hand closes; None for a step that does not grasp.
    """

    plan: Callable[[], StepPlan]
    name: str = ""
    grasp: Array | None = None


@dataclass(frozen=True, slots=True)
class Candidates:
    """All ways to do a step, lazily.

    Attributes:
        options: in the order in which they are tried.
        what: begins the refusal of all of them: "cannot pick 'cup'"; "" for a step with a single way, whose refusal is
            its own.
        decides: what later steps depend on; the search comes back only to steps that decide something.
        explain: (refusal of all) -> the same with a better hint.
        further: the candidates after these, if there are any: costlier ones. Their refusal counts, not that of these.
    """

    options: Iterable[Candidate]
    what: str = ""
    decides: Decision = "nothing"
    explain: Callable[[NotPlannable], NotPlannable] = lambda refusal: refusal
    further: Callable[[], Candidates | None] = lambda: None


@dataclass(frozen=True, slots=True)
class Chosen:
    """A candidate, its plan, the candidates that were refused before it, and its `index` among
    all; 0 for one of `Candidates.further`."""

    candidate: Candidate
    plan: StepPlan
    dropped: tuple[Dropped, ...] = ()
    index: int = 0


@dataclass(frozen=True, slots=True)
class Dropped:
    """A candidate that was not taken.

    Attributes:
        name: of the candidate; "" for the only way.
        refusal: the reason; of a later step, if the candidate has a plan.
        plan: its plan, or None.
    """

    name: str
    refusal: NotPlannable
    plan: StepPlan | None = None


class Attempts:
    """The candidates of one step in one state, tried as far as needed.

    Args:
        candidates: of the step.
        exclude: grasps, R_WT (3, 3) each; candidates near one of them are skipped.
        prefer: index of the candidate that is tried before all others.
    """

    def __init__(self, candidates: Candidates, exclude: Iterable[Array] = (), *, prefer: int = 0) -> None:
        self.decides = candidates.decides
        self.excluded = [*exclude]
        self.dropped: list[Dropped] = []
        self._candidates = candidates
        self._options: Iterator[tuple[int, Candidate]] = _preferring(enumerate(candidates.options), prefer)

    def take(self) -> Chosen:
        """The next candidate with a plan.

        Raises:
            NotPlannable: no other candidate has one; with the commonest reasons of all refused ones.
        """
        for index, candidate in self._options:
            if candidate.grasp is not None and any(alike(candidate.grasp, R_WT) for R_WT in self.excluded):
                continue
            try:
                return Chosen(candidate, candidate.plan(), tuple(self.dropped), index)
            except NotPlannable as refusal:
                self.dropped.append(Dropped(candidate.name, refusal))
        further = self._candidates.further()
        if further is None:
            raise self._candidates.explain(refusal_of(self.dropped, self._candidates.what))
        self._candidates, self._options, self.dropped = further, zip(itertools.repeat(0), further.options), []
        return self.take()


def _preferring(options: Iterator[tuple[int, Candidate]], index: int) -> Iterator[tuple[int, Candidate]]:
    """The same with the option of this index first."""
    skipped = list(itertools.islice(options, index))
    yield from itertools.islice(options, 1)
    yield from skipped
    yield from options


def first(candidates: Candidates, exclude: Iterable[Array] = ()) -> StepPlan:
    """The plan of the first candidate that has one.

    Raises:
        NotPlannable: none has.
    """
    return Attempts(candidates, exclude).take().plan


def refusal_of(dropped: Iterable[Dropped], what: str) -> NotPlannable:
    """The refusal of all candidates: how many there were, and the commonest reasons.

    Reasons that differ only in their numbers are grouped, and the first is shown. The hint is that of the commonest
    reason, and the parts are those of all.
    """
    reasons: dict[str, list[NotPlannable]] = {}
    for each in dropped:
        reasons.setdefault(NUMBER.sub("#", each.refusal.cause), []).append(each.refusal)
    if not reasons:
        return NotPlannable(f"{what}: there is no candidate")
    commonest = sorted(reasons.values(), key=lambda refusals: -len(refusals))
    first_, tried = commonest[0][0], sum(map(len, commonest))
    if not what:
        return first_
    parts = frozenset(part for refusals in commonest for refusal in refusals for part in refusal.parts)
    if tried == 1:
        return NotPlannable(f"{what}: {first_.cause}", hint=first_.hint, parts=parts, remedy=first_.remedy)
    shown = "; ".join(f"{refusals[0].cause} ({len(refusals)} of {tried})" for refusals in commonest[:REASONS])
    more = len(commonest) - REASONS
    others = f"; and {number_of(more, 'other reason')}" if more > 0 else ""
    cause = f"{what}, all {tried} candidates failed: {shown}{others}"
    return NotPlannable(cause, hint=first_.hint, parts=parts, remedy=first_.remedy)


def alike(R_A: Array, R_B: Array) -> bool:
    """Whether two rotations (3, 3) differ by less than `OTHER`; the trace of R_A^T R_B is 1 + 2 cos(angle)."""
    return float(np.sum(R_A * R_B)) > 1.0 + 2.0 * math.cos(OTHER)
