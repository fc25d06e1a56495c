"""What became of a step, by its events alone: attempts, what may fail, a log without a plan."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from manipcli.judge.steps import step_outcomes
from manipcli.judge.verdict import StepOutcome, own_name
from manipcli.record.recording import Recording, TaskEvent

PLAN = b'{"steps": [{"id": "a", "verb": "move", "planned_duration": 1.5}]}'


def outcomes(*told: str, plan: bytes = PLAN, interrupted: bool = False) -> tuple[StepOutcome, ...]:
    """Of events as `1.0 a ended failed`, the kind without its `step_`."""
    events = []
    for line in told:
        time, step, kind, *outcome = line.split()
        name = kind if kind == "replanned" else f"step_{kind}"
        events.append(TaskEvent(float(time), name, step, "move", " ".join(outcome), f"at {time}", "t.yaml:1:1"))
    log = SimpleNamespace(events=tuple(events), attachments={"plan.json": plan})
    return step_outcomes(cast("Recording", log), interrupted=interrupted)


TWICE = ("0.0 a started", "1.0 a ended failed", "1.0 a started", "1.2 a replanned", "3.0 a ended done")


def test_a_step_lasts_from_its_first_attempt_to_the_end_of_its_last() -> None:
    (step,) = outcomes(*TWICE)
    assert (step.outcome, step.started, step.ended, step.planned_duration) == ("done", 0.0, 3.0, 1.5)
    assert [(one.outcome, one.started, one.ended) for one in step.attempts] == [
        ("failed", 0.0, 1.0),
        ("done", 1.0, 3.0),
    ]
    assert (step.text, step.replanned) == ("at 3.0", ("at 1.2",))


def test_of_two_ends_of_an_attempt_the_later_one_counts() -> None:
    (step,) = outcomes("0.0 a started", "1.0 a ended done", "1.0 a ended failed")
    assert (step.outcome, step.text, len(step.attempts)) == ("failed", "at 1.0", 1)


@pytest.mark.parametrize(
    ("then", "tolerated"), [((), False), (("1.0 a tolerated",), True), (("1.0 a tolerated", "2.0 a started"), False)]
)
def test_what_may_fail_is_what_was_let_go_last(then: tuple[str, ...], tolerated: bool) -> None:
    (step,) = outcomes("0.0 a started", "1.0 a ended failed", *then, interrupted=True)
    assert step.tolerated is tolerated
    assert step.outcome == ("interrupted" if "2.0 a started" in then else "failed")


def test_without_a_plan_each_step_that_started_is_one_however_often_it_did() -> None:
    steps = outcomes(*TWICE, "3.0 b started", plan=b"[")
    assert [(one.id, one.verb, one.outcome, one.planned_duration) for one in steps] == [
        ("a", "move", "done", 0.0),
        ("b", "move", "failed", 0.0),
    ]


def test_an_outcome_that_nobody_knows_is_a_failure_that_names_it() -> None:
    (step,) = outcomes("0.0 a started", "1.0 a ended splendid")
    assert (step.outcome, step.text) == ("failed", "unknown outcome 'splendid' at 1.0")


def test_a_label_tells_the_verb_only_where_its_own_name_does_not() -> None:
    def label(id: str) -> str:
        return StepOutcome(id, "pick", "done", 0.0, 1.0, 1.0).label

    assert [*map(label, ("pick_1", "take", "sort[0]/pick_1", "pick_all/take"))] == [
        "pick_1",
        "take (pick)",
        "sort[0]/pick_1",
        "pick_all/take (pick)",
    ]
    assert own_name("sort[0]/if_1/place_1") == "place_1"
    assert own_name("sort[0]/if_1/else/place_1") == "else/place_1"
    assert own_name("pick_1") == "pick_1"
