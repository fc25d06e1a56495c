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
from manipcli.core.work import WorkSpent
from manipcli.plan.motion import StepPlan

Decision = Literal["nothing", "grasp", "place", "branch"]
"""What later steps depend on: how an object is held, where it is put, or the configuration of the arm."""

REASONS: Final = 3
"""Number of reasons that a refusal lists."""
OTHER: Final = math.radians(40.0)
"""[rad] Grasps that differ by less count as the same: where one of them fails, the other is likely to fail."""
ELSEWHERE: Final = 0.3
"""Share of the sides of a region: places nearer in both directions count as the same."""
SPENT: Final = "the search ended at its work budget"
"""Ends the cause of a refusal that is not of all candidates."""
NUMBER: Final = re.compile(r"(?<![\w.])-?\d+(\.\d+)?")
"""A number in a cause, but no digits in a name."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to do a step.

    Attributes:
        plan: its plan; raises NotPlannable.
        name: in reports; "" for the only way.
        grasp: R_WT (3, 3) of the tool when the hand closes; None for a step that does not grasp.
        place: (2,) where in a region an object is put, in shares of its sides; None for a step without a region.
        look: why `plan` surely raises, found much sooner than by it; None if it may have a plan. The reason that is
            reported is that of `plan`.
    """

    plan: Callable[[], StepPlan]
    name: str = ""
    grasp: Array | None = None
    look: Callable[[], NotPlannable | None] = lambda: None
    place: Array | None = None

    @property
    def choice(self) -> Array | None:
        """What later steps depend on: its grasp or its place."""
        return self.place if self.grasp is None else self.grasp


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
    """A candidate, its plan, and its `index` among all; 0 for one of `Candidates.further`."""

    candidate: Candidate
    plan: StepPlan
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
        exclude: grasps, R_WT (3, 3) each, and places, (2,); candidates near one of them are skipped.
        prefer: index of the candidate that is tried before all others.
        on_candidate: called with the number of each candidate that is tried, from 1.
    """

    def __init__(
        self,
        candidates: Candidates,
        exclude: Iterable[Array] = (),
        *,
        prefer: int = 0,
        on_candidate: Callable[[int], None] = lambda _: None,
    ) -> None:
        self.decides = candidates.decides
        self._on_candidate = on_candidate
        self._tried = 0
        self.excluded = [*exclude]
        self._refused: list[tuple[Candidate, NotPlannable | None]] = []  # None: at a look
        self._before: tuple[Dropped, ...] = ()  # those before `further`
        self._candidates = candidates
        self._options: Iterator[tuple[int, Candidate]] = _preferring(enumerate(candidates.options), prefer)

    def take(self) -> Chosen:
        """The next candidate with a plan.

        Raises:
            NotPlannable: no other candidate has one; with the commonest reasons of all refused ones.
        """
        for index, candidate in self._options:
            if candidate.choice is not None and any(alike(candidate.choice, other) for other in self.excluded):
                continue
            self._tried += 1
            self._on_candidate(self._tried)
            # A look costs part of a plan: the first candidate often has one.
            if self._refused and candidate.look() is not None:
                self._refused.append((candidate, None))
                continue
            try:
                return Chosen(candidate, candidate.plan(), index)
            except NotPlannable as refusal:
                self._refused.append((candidate, refusal))
        further = self._candidates.further()
        if further is None:
            raise self.refusal()
        self._before = tuple(Dropped(each.name, refusal) for each, refusal in self._refused if refusal is not None)
        self._candidates, self._options, self._refused = further, zip(itertools.repeat(0), further.options), []
        return self.take()

    def refusal(self, *, cut: bool = False) -> NotPlannable:
        """The refusal of all candidates so far; `cut`: the search ended at its budget, not at the last candidate."""
        dropped = self.dropped or (self._before if cut else ())
        return self._candidates.explain(refusal_of(dropped, self._candidates.what, cut=cut))

    @property
    def dropped(self) -> tuple[Dropped, ...]:
        """The refused candidates; those that were refused at a look are planned for their reason."""
        self._refused = [(each, _reason(each) if refusal is None else refusal) for each, refusal in self._refused]
        return tuple(Dropped(each.name, refusal) for each, refusal in self._refused if refusal is not None)


def _reason(candidate: Candidate) -> NotPlannable | None:
    """The refusal by its plan of a candidate that a look refused; that of the look where the budget is spent."""
    try:
        candidate.plan()
    except NotPlannable as refusal:
        return refusal
    except WorkSpent:
        pass
    return candidate.look()


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


def refusal_of(dropped: Iterable[Dropped], what: str, *, cut: bool = False) -> NotPlannable:
    """The refusal of all candidates: how many there were, and the commonest reasons; `cut`: there may be more.

    Reasons that differ only in their numbers are grouped, and the first is shown. The hint is that of the commonest
    reason, and the parts are those of all.
    """
    reasons: dict[str, list[NotPlannable]] = {}
    for each in dropped:
        reasons.setdefault(NUMBER.sub("#", each.refusal.cause), []).append(each.refusal)
    if not reasons:
        return NotPlannable(": ".join(filter(None, (what, SPENT if cut else "there is no candidate"))))
    commonest = sorted(reasons.values(), key=lambda refusals: -len(refusals))
    first_, tried = commonest[0][0], sum(map(len, commonest))
    if not what:
        return first_.but(cause=f"{first_.cause}; {SPENT}") if cut else first_
    parts = frozenset(part for refusals in commonest for refusal in refusals for part in refusal.parts)
    end = f"; {SPENT}" if cut else ""
    if tried == 1:
        return NotPlannable(f"{what}: {first_.cause}{end}", hint=first_.hint, parts=parts, remedy=first_.remedy)
    shown = "; ".join(f"{refusals[0].cause} ({len(refusals)} of {tried})" for refusals in commonest[:REASONS])
    more = len(commonest) - REASONS
    others = f"; and {number_of(more, 'other reason')}" if more > 0 else ""
    cause = f"{what}, {'the first' if cut else 'all'} {tried} candidates failed: {shown}{others}{end}"
    return NotPlannable(cause, hint=first_.hint, parts=parts, remedy=first_.remedy)


def alike(a: Array, b: Array) -> bool:
    """Whether two grasps, rotations (3, 3), differ by less than `OTHER`, or two places (2,) by less than `ELSEWHERE`.

    The trace of A^T B is 1 + 2 cos(angle).
    """
    if a.shape != b.shape:
        return False
    if a.shape == (2,):
        return float(np.max(np.abs(a - b))) < ELSEWHERE
    return float(np.sum(a * b)) > 1.0 + 2.0 * math.cos(OTHER)
