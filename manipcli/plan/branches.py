"""Plans of all branches of a task: a tree, whose branches share the plan of their common beginning.

One combination of outcomes is planned as a whole. Every other one is planned from the end of what it shares with it.
Where it has no plan from there, it is planned first and as a whole, and the others from its beginning.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from manipcli.core.errors import NotPlannable
from manipcli.plan.block_tree import Item, Outcomes, Unit, choices, named, stretch
from manipcli.plan.motion import PlanningState

S = TypeVar("S")


@dataclass(frozen=True, slots=True)
class Solved(Generic[S]):
    """The plans of the steps of each unit, and the state after each."""

    steps: tuple[tuple[S, ...], ...]
    ends: tuple[PlanningState, ...]


class _Refused(Exception):
    """A combination without a plan."""

    def __init__(self, outcomes: Outcomes, refusal: NotPlannable) -> None:
        super().__init__()
        self.outcomes = outcomes
        self.refusal = refusal


def plan_branches(
    items: Sequence[Item], start: PlanningState, solve: Callable[[Sequence[Unit], PlanningState, Outcomes], Solved[S]]
) -> Mapping[Outcomes, tuple[S, ...]]:
    """The plan of every stretch that is planned before the run.

    Args:
        items: of the task.
        start: the state before its first step.
        solve: plans units from a state, together; the outcomes name the stretch of the last. The first call is for the
            path on which every choice takes `then`.

    Raises:
        NotPlannable: a combination of outcomes has no plan; the refusal names it.
    """
    followed = choices(items).followed

    def path(key: Outcomes, lead: Outcomes) -> list[Outcomes]:
        """The stretches from `key` on, with the outcomes of `lead`, then always `then`."""
        found = [key]
        while found[-1] in followed:
            k = len(found[-1])
            found.append((*found[-1], lead[k] if k < len(lead) else True))
        return found

    def whole(key: Outcomes, before: PlanningState, lead: Outcomes) -> dict[Outcomes, tuple[S, ...]]:
        """All stretches from `key` on, with the path of `lead` first."""
        keys = path(key, lead)
        of_each = [stretch(items, one).units for one in keys]
        try:
            solved = solve([unit for units in of_each for unit in units], before, keys[-1])
        except NotPlannable as refusal:
            raise _Refused(keys[-1], refusal) from refusal
        found: dict[Outcomes, tuple[S, ...]] = {}
        ends = []
        first = 0
        for one, units in zip(keys, of_each, strict=True):
            last = first + len(units)
            found[one] = tuple(step for steps in solved.steps[first:last] for step in steps)
            ends.append(solved.ends[last - 1] if last else before)
            first = last
        for one, after, end in reversed([*zip(keys, keys[1:], ends, strict=False)]):
            found |= all_from((*one, not after[-1]), end)
        return found

    def all_from(key: Outcomes, before: PlanningState) -> dict[Outcomes, tuple[S, ...]]:
        lead = path(key, key)[-1]
        tried = {lead}
        while True:
            try:
                return whole(key, before, lead)
            except _Refused as refused:
                if refused.outcomes in tried:
                    raise
                lead = refused.outcomes
                tried.add(lead)

    try:
        return all_from((), start)
    except _Refused as refused:
        refusal = refused.refusal
        if not refused.outcomes:
            raise refusal from refusal.__cause__
        raise refusal.but(cause=f"{refusal.cause} (in the branch {named(items, refused.outcomes)})") from refusal
