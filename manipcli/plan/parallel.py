"""Two steps at once: the plan of a step of the arm beside one of the hand, from the same state.

Neither waits for the other, so the arm must be free of collisions whatever the hand has reached by then: its path is
checked with the hand at the begin and at the end of its motion, and at positions between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.plan.sweep import refuse_collision

BETWEEN: Final = 3
"""Number of positions of the hand between the two ends of its motion."""


def beside(planner: Planner, arm: Candidates, hand: StepPlan, state: PlanningState) -> Candidates:
    """The candidates of a step of the arm, each with the hand's motion at the same time; both begin in `state`.

    Raises:
        NotPlannable: the hand carries something.
    """
    if state.carried is not None:
        raise NotPlannable(
            f"the hand holds '{state.carried.body}', so it cannot move at the same time as the arm",
            hint="do the two steps one after the other",
        )

    def joined(candidate: Candidate) -> Candidate:
        return replace(candidate, plan=lambda: _joined(planner, candidate.plan(), hand, state))

    def options() -> Iterator[Candidate]:
        yield from map(joined, arm.options)

    def further() -> Candidates | None:
        more = arm.further()
        return None if more is None else beside(planner, more, hand, state)

    return replace(arm, options=options(), further=further)


def _joined(planner: Planner, arm: StepPlan, hand: StepPlan, state: PlanningState) -> StepPlan:
    """The plan of the arm's step; its end has the hand where its own step takes it."""
    if any(motion.grip is not None for motion in arm.motions):
        raise NotPlannable(
            "this step moves the hand, too, while another step moves it",
            hint="name a pose of the arm's joints alone",
        )
    for share in np.linspace(0.0, 1.0, BETWEEN + 2)[1:]:
        reached = state.position + share * (hand.end.position - state.position)
        for motion in arm.motions:
            if motion.trajectory is not None:
                before = replace(motion.begins or state, position=_with_hand(state, reached, motion.begins or state))
                query = planner.query(before, motion.allowed)
                refuse_collision(planner, before, query, motion.label, motion.trajectory, None)
    end = arm.end.moved(_with_hand(state, hand.end.position, arm.end))
    return replace(arm, end=replace(end, closed=hand.end.closed))


def _with_hand(start: PlanningState, reached: Array, state: PlanningState) -> Array:
    """(n) the position of `state`, with the joints that the hand has moved from `start` where it has `reached`."""
    return frozen(np.where(reached != start.position, reached, state.position))
