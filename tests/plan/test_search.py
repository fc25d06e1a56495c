from __future__ import annotations

import pytest
from pydantic import TypeAdapter, ValidationError

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import frozen
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.search import Range, first_feasible, spread

PLAN = StepPlan(motions=(), end=PlanningState(position=frozen([0.0]), bodies=()))


def test_a_range_is_tried_from_its_middle() -> None:
    assert spread((0.1, 0.3)) == (0.2, 0.1, 0.3)
    assert spread((0.1, 0.1)) == (0.1,)


def test_a_range_rises() -> None:
    lengths: TypeAdapter[tuple[float, float]] = TypeAdapter(Range)
    assert lengths.validate_python(["8 cm", "20 cm"]) == (0.08, 0.2)
    assert lengths.validate_python("8 cm") == (0.08, 0.08)
    with pytest.raises(ValidationError, match="minimum 200 mm is above maximum 80 mm"):
        lengths.validate_python(["20 cm", "8 cm"])
    assert lengths.validate_python([0, 0.1]) == (0.0, 0.1)
    for below in ("-5 cm", ["-5 cm", "5 cm"]):
        with pytest.raises(ValidationError, match="must be at least 0, not -50 mm") as refused:
            lengths.validate_python(below)
        assert refused.value.errors()[0]["ctx"]["hint"] == "write [minimum, maximum], both 0 or more, or one length"


def test_the_first_that_can_be_planned_is_taken_and_no_other_is_tried() -> None:
    tried = []

    def attempt(k: int) -> StepPlan:
        tried.append(k)
        if k < 2:
            raise NotPlannable("no")
        return PLAN

    assert first_feasible(attempt, range(10), what="w") is PLAN
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
        first_feasible(attempt, reasons, what="no way")
    assert refusal.value.cause == (
        "no way, all 7 candidates failed: off by -0.5 mm (3 of 7); joint 'joint_4' goes to 2.5 at t = 0.1 s (2 of 7); "
        "joint 'joint_2' goes to 2.5 at t = 0.1 s (1 of 7); and 1 other reason"
    )
    assert refusal.value.hint == "nearer"


def test_a_single_candidate_is_refused_with_its_own_words() -> None:
    def attempt(_: int) -> StepPlan:
        raise NotPlannable("too far", hint="nearer")

    with pytest.raises(NotPlannable) as refusal:
        first_feasible(attempt, [1], what="no way")
    assert (refusal.value.cause, refusal.value.hint) == ("no way: too far", "nearer")
    with pytest.raises(NotPlannable, match="there is no candidate"):
        first_feasible(attempt, [], what="no way")


def test_what_is_no_refusal_is_not_swallowed() -> None:
    def attempt(_: int) -> StepPlan:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        first_feasible(attempt, [1], what="no way")
