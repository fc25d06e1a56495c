from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import TypeVar

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import frozen, matrix_from_axis_angle
from manipcli.plan.candidates import Attempts, Candidate, Candidates, first
from manipcli.plan.motion import PlanningState, StepPlan

PLAN = StepPlan(motions=(), end=PlanningState(position=frozen([0.0]), bodies=()))
T = TypeVar("T")


def of(attempt: Callable[[T], StepPlan], values: Iterable[T], what: str) -> Candidates:
    return Candidates((Candidate(partial(attempt, value), name=str(value)) for value in values), what=what)


def test_the_first_that_can_be_planned_is_taken_and_no_other_is_tried() -> None:
    tried = []

    def attempt(k: int) -> StepPlan:
        tried.append(k)
        if k < 2:
            raise NotPlannable("no")
        return PLAN

    assert first(of(attempt, range(10), "w")) is PLAN
    assert tried == [0, 1, 2]


def test_a_refusal_tells_the_commonest_reasons_with_the_hint_of_the_commonest() -> None:
    """Reasons that differ in their numbers alone are one; digits in names are no numbers."""
    reasons = [
        *(("joint 'joint_4' goes to 2.5 at t = 0.1 s", "slower"), ("joint 'joint_2' goes to 2.5 at t = 0.1 s", None)),
        *((f"off by -{k}.5 mm", "nearer") for k in range(3)),
        *(("joint 'joint_4' goes to 2.7 at t = 0.3 s", None), ("something else", None)),
    ]

    def attempt(reason: tuple[str, str | None]) -> StepPlan:
        raise NotPlannable(reason[0], hint=reason[1])

    with pytest.raises(NotPlannable) as refusal:
        first(of(attempt, reasons, "no way"))
    assert refusal.value.cause == (
        "no way, all 7 candidates failed: off by -0.5 mm (3 of 7); joint 'joint_4' goes to 2.5 at t = 0.1 s (2 of 7); "
        "joint 'joint_2' goes to 2.5 at t = 0.1 s (1 of 7); and 1 other reason"
    )
    assert refusal.value.hint == "nearer"


def test_a_single_candidate_is_refused_with_its_own_words() -> None:
    def attempt(_: int) -> StepPlan:
        raise NotPlannable("too far", hint="nearer")

    with pytest.raises(NotPlannable) as refusal:
        first(of(attempt, [1], "no way"))
    assert (refusal.value.cause, refusal.value.hint) == ("no way: too far", "nearer")
    with pytest.raises(NotPlannable, match="there is no candidate"):
        first(of(attempt, [], "no way"))


def test_what_is_no_refusal_is_not_swallowed() -> None:
    def attempt(_: int) -> StepPlan:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        first(of(attempt, [1], "no way"))


def test_each_attempt_continues_after_the_last_and_tells_what_was_dropped() -> None:
    def attempt(k: int) -> StepPlan:
        if k % 2:
            raise NotPlannable(f"{k} is odd")
        return PLAN

    attempts = Attempts(of(attempt, range(4), "no way"))
    one, two = attempts.take(), attempts.take()
    assert (one.candidate.name, two.candidate.name) == ("0", "2")
    assert [(each.name, each.refusal.cause) for each in attempts.dropped] == [("1", "1 is odd")]
    with pytest.raises(NotPlannable, match=r"all 2 candidates failed: 1 is odd \(2 of 2\)"):
        attempts.take()


def test_a_look_is_asked_after_a_refusal_and_spares_the_plan_until_its_reason_is_wanted() -> None:
    looked, planned = [], []

    def look(k: int) -> NotPlannable | None:
        looked.append(k)
        return NotPlannable("seen") if k < 3 else None

    def plan(k: int) -> StepPlan:
        planned.append(k)
        if k < 3:
            raise NotPlannable(f"why {k}")
        return PLAN

    attempts = Attempts(Candidates(Candidate(partial(plan, k), name=str(k), look=partial(look, k)) for k in range(5)))
    assert attempts.take().candidate.name == "3"
    assert (looked, planned) == ([1, 2, 3], [0, 3])
    assert [(each.name, each.refusal.cause) for each in attempts.dropped] == [(str(k), f"why {k}") for k in range(3)]
    assert planned == [0, 3, 1, 2]
    assert len(attempts.dropped) == 3 and len(planned) == 4


def test_grasps_near_an_excluded_one_are_skipped() -> None:
    up = np.array([0.0, 0.0, 1.0])
    turned = [matrix_from_axis_angle(up, np.radians(angle)) for angle in (0.0, 39.0, 41.0)]
    options = [Candidate(lambda: PLAN, name=str(k), grasp=R) for k, R in enumerate(turned)]
    assert Attempts(Candidates(options), exclude=[np.eye(3)]).take().candidate.name == "2"


def test_the_parts_in_the_way_of_all_candidates_are_known() -> None:
    def attempt(name: str) -> StepPlan:
        raise NotPlannable("blocked", parts=frozenset({name}))

    with pytest.raises(NotPlannable) as refusal:
        first(of(attempt, ["cup", "tray"], "no way"))
    assert refusal.value.parts == {"cup", "tray"}
