"""Agreement of runs: outcomes must be the same, numbers may differ by what `agree:` allows and no more."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.errors import Loc, Place
from manipcli.judge.agreement import Agreement, compare
from manipcli.judge.measured_run import GraspNumbers, MeasuredRun, Variant
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, StepWord, Verdict, VerdictWord
from manipcli.report.agreement.agreement_json import agreement_object
from manipcli.report.agreement.agreement_text import numbers_table, render_text
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.agreement.disagreement import message
from manipcli.report.run_report import RunReport, Timing
from manipcli.spec.agree import AgreeSpec

STEPS = (
    StepOutcome("pick_1", "pick", "done", 0.0, 2.0, 1.9),
    StepOutcome("pour_1", "pour", "done", 2.0, 8.0, 5.9),
)
INSIDE = ExpectationOutcome("inside", "passed", 0.012, "m", 9.5)
UPRIGHT = ExpectationOutcome("upright", "passed", 0.30, "rad", 4.0)
VERDICT = Verdict("pour", "passed", 0, "", 10.0, STEPS, (INSIDE, UPRIGHT))
PLACES: dict[Loc, Place] = {
    key: Place("pour.yaml", line, 5)
    for line, key in enumerate(
        [("task",), ("steps", 0), ("steps", 1), ("judged", 0), ("judged", 1), ("agree", "margins", "inside")], start=1
    )
}


def run(
    engine: str, verdict: Verdict = VERDICT, *, half_step: bool = False, agree: AgreeSpec | None = None
) -> MeasuredRun:
    return MeasuredRun(
        Variant(engine, half_step),
        verdict,
        1e-3,
        2.0,
        log=f"{engine}.mcap",
        grasps=(GraspNumbers("cup", 0.001, 0.01, 35.0),),
        forces={"pick_1": 20.0},
        agree=agree or AgreeSpec(),
        places=PLACES,
    )


def with_margin(margin: float, *, unit: str = "m") -> Verdict:
    """`inside` with this margin, failed where it is negative."""
    word: Literal["passed", "failed"] = "passed" if margin >= 0.0 else "failed"
    changed = replace(INSIDE, margin=margin, unit=unit, outcome=word)
    return replace(VERDICT, expectations=(changed, UPRIGHT), verdict=word)


def with_step(outcome: StepWord, *, tolerated: bool = False) -> Verdict:
    changed = replace(STEPS[1], outcome=outcome, text="the ball is not in the tray", tolerated=tolerated)
    verdict: VerdictWord = "passed" if tolerated or outcome == "done" else "failed"
    unmet = () if tolerated else (replace(INSIDE, outcome="failed", margin=-1.0), UPRIGHT)
    return replace(VERDICT, steps=(STEPS[0], changed), verdict=verdict, expectations=unmet or (INSIDE, UPRIGHT))


def test_equal_runs_agree_whatever_is_allowed() -> None:
    strict = AgreeSpec(margin=0.0, margins={"inside": 0.0}, duration=0.0, slip=0.0, force=0.0)
    assert compare([run("a", agree=strict), run("b", agree=strict)]).agrees


def test_a_margin_may_differ_by_any_amount_by_default_but_not_its_sign() -> None:
    assert compare([run("a"), run("b", with_margin(0.9))]).agrees
    (found,) = compare([run("a"), run("b", with_margin(-1e-6))]).disagreements
    assert (found.cause, found.kind, found.name, found.runs) == ("engines", "expectation", "inside", ("a", "b"))
    assert found.outcomes == ("passed", "failed")
    assert [value.value for value in found.values if value is not None] == [0.012, -1e-6]
    assert found.place == Place("pour.yaml", 4, 5)


@pytest.mark.parametrize(
    ("agree", "limit"),
    [
        (AgreeSpec(margin=0.5), None),  # of the larger margin
        (AgreeSpec(margins={"inside": "50 %"}), None),
        (AgreeSpec(margins={"inside": "1 cm"}), 0.010),
        (AgreeSpec(margins={"inside": 0.010}), 0.010),
        (AgreeSpec(margin=0.0, margins={"inside": "1 cm"}), 0.010),  # a single margin goes before all
    ],
)
def test_a_margin_differs_by_what_is_allowed_and_no_more(agree: AgreeSpec, limit: float | None) -> None:
    larger = 0.040
    allowed = 0.5 * larger if limit is None else limit
    for share, agrees in ((0.999, True), (1.001, False)):
        runs = [run("a", with_margin(larger), agree=agree), run("b", with_margin(larger - share * allowed))]
        made = compare(runs)
        assert made.agrees == agrees
        row = next(row for row in made.rows if (row.kind, row.name) == ("margin", "inside"))
        assert row.allowed == pytest.approx(allowed, rel=1e-12)
        assert row.difference == pytest.approx(share * allowed, rel=1e-9)
    (found,) = made.disagreements
    assert (found.kind, found.name, found.place) == ("margin", "inside", Place("pour.yaml", 4, 5))
    assert found.allowed == pytest.approx(allowed)


def test_a_share_ignores_what_is_too_small_to_matter_and_an_amount_does_not() -> None:
    near = with_margin(0.0125)  # 0.5 mm more: below the floor of 1 mm
    assert compare([run("a", agree=AgreeSpec(margin=0.0)), run("b", near)]).agrees
    assert not compare([run("a", agree=AgreeSpec(margins={"inside": "0.4 mm"})), run("b", near)]).agrees


def test_all_limits_in_another_unit_than_the_margins_of_the_runs_are_reported_with_the_numbers() -> None:
    """Conditions with several units: only the runs show which one decides."""
    agree = AgreeSpec(margins={"inside": "2 deg", "upright": "1 cm"})
    made = compare([run("a", agree=agree), run("b", with_margin(0.5))])
    assert [(found.cause, found.name) for found in made.disagreements] == [("limit", "inside"), ("limit", "upright")]
    assert made.disagreements[0].place == Place("pour.yaml", 6, 5)
    assert [message(found) for found in made.disagreements] == [
        "a limit cannot be used: agree.margins.inside: '2 deg' is an angle; the margin is in m",
        "a limit cannot be used: agree.margins.upright: '1 cm' is a length; the margin is in rad",
    ]
    lines = numbers_table(made).splitlines()
    assert [line.split()[1] for line in lines if line.endswith("other unit")] == ["inside", "upright"]
    assert agreement_object(made)["disagreements"]
    failed = compare([run("a", agree=agree), run("b", with_margin(-0.01))]).disagreements
    assert [found.cause for found in failed] == ["engines", "limit", "limit"], "nor do they hide a verdict"


def test_a_limit_of_what_no_two_engines_have_is_warned_about() -> None:
    """Of what they have, it is not; nor where one engine was run, or nothing."""
    every = AgreeSpec(
        margin=0.1, margins={"inside": "5 cm", "upright": "50 %"}, duration=0.1, slip=0.01, force=0.1, contact_force=0.1
    )
    assert compare([run("a", agree=every), run("b")]).warnings == ()
    bare = {"grasps": (), "forces": {}}
    one = [replace(run("a", agree=every), **bare), run("b")]
    messages = [finding.message for finding in compare(one).warnings]
    assert messages == [
        "agree.slip has no effect: fewer than two engines have a slip in the hand",
        "agree.force has no effect: fewer than two engines have a grasp",
        "agree.contact_force has no effect: fewer than two engines have a contact",
    ]
    unmet = replace(VERDICT, expectations=(replace(INSIDE, outcome="not_evaluated", margin=None), UPRIGHT))
    (finding,) = compare([run("a", unmet, agree=every), run("b", unmet)]).warnings
    assert (finding.code, finding.severity, finding.place) == ("TASK248", "warning", Place("pour.yaml", 6, 5))
    assert finding.message == "agree.margins.inside has no effect: fewer than two engines have a margin of 'inside'"
    assert compare([replace(run("a", agree=every), **bare), run("a", half_step=True)]).warnings == ()


def test_the_peak_contact_force_of_a_step_differs_by_what_is_allowed() -> None:
    other = replace(run("b"), forces={"pick_1": 25.0})
    assert compare([run("a", agree=AgreeSpec(contact_force=0.2)), other]).agrees
    (found,) = compare([run("a", agree=AgreeSpec(contact_force=0.19)), other]).disagreements
    assert (found.kind, found.name, found.allowed) == ("contact_force", "pick_1", pytest.approx(0.19 * 25.0))
    assert compare([run("a", agree=AgreeSpec(force=0.0)), other]).agrees, "that limits grasps"


def test_the_table_says_between_which_runs_differences_are() -> None:
    pair = [run("a"), run("b")]
    note = "difference: between the engines at the step of the task"
    assert note not in numbers_table(compare(pair))
    assert note in numbers_table(compare([*pair, run("a", half_step=True)]))
    assert note not in numbers_table(compare([run("a"), run("a", half_step=True)])), "no differences"


def test_margins_in_different_units_are_not_comparable_where_they_are_limited() -> None:
    other = with_margin(0.012, unit="rad")
    assert compare([run("a"), run("b", other)]).agrees
    (found,) = compare([run("a", agree=AgreeSpec(margin=0.5)), run("b", other)]).disagreements
    assert [value.unit for value in found.values if value is not None] == ["m", "rad"]


@pytest.mark.parametrize(
    ("agree", "changed", "kind"),
    [
        (AgreeSpec(duration=0.05), replace(VERDICT, simulated_time=10.6), "duration"),
        (
            AgreeSpec(duration=0.05),
            replace(VERDICT, steps=(replace(STEPS[0], ended=2.2), STEPS[1])),
            "step_duration",
        ),
    ],
)
def test_durations_differ_by_a_share(agree: AgreeSpec, changed: Verdict, kind: str) -> None:
    assert compare([run("a"), run("b", changed)]).agrees
    (found,) = compare([run("a", agree=agree), run("b", changed)]).disagreements
    assert found.kind == kind


@pytest.mark.parametrize(
    ("agree", "grasp", "kind"),
    [
        (AgreeSpec(slip=0.002), GraspNumbers("cup", 0.0031, 0.01, 35.0), "slip"),
        (AgreeSpec(force=0.1), GraspNumbers("cup", 0.001, 0.01, 39.5), "grasp_force"),
    ],
)
def test_slip_and_force_of_a_grasp_differ_by_what_is_allowed(agree: AgreeSpec, grasp: GraspNumbers, kind: str) -> None:
    other = replace(run("b"), grasps=(grasp,))
    assert compare([run("a"), other]).agrees
    (found,) = compare([run("a", agree=agree), other]).disagreements
    assert (found.kind, found.name) == (kind, "cup")
    none = replace(run("b"), grasps=())
    assert compare([run("a", agree=agree), none]).agrees, "what a run does not have is not compared"


def test_a_step_that_fails_in_one_engine_is_the_only_disagreement() -> None:
    (found,) = compare([run("a"), run("b", with_step("timeout"))]).disagreements
    assert (found.kind, found.name, found.outcomes) == ("step", "pour_1", ("done", "timeout"))
    assert found.texts == ("", "the ball is not in the tray")
    assert found.place == Place("pour.yaml", 3, 5)
    assert compare([run("a"), run("b", with_step("failed", tolerated=True))]).agrees


def test_a_verdict_that_no_step_or_expectation_explains_disagrees() -> None:
    (found,) = compare([run("a"), run("b", replace(VERDICT, verdict="failed", text="diverged"))]).disagreements
    assert (found.kind, found.outcomes, found.texts) == ("verdict", ("passed", "failed"), ("", "diverged"))


def test_runs_that_fail_alike_agree() -> None:
    assert compare([run("a", with_margin(-0.01)), run("b", with_margin(-0.02))]).agrees


def test_half_the_step_may_change_numbers_but_no_outcome() -> None:
    strict = AgreeSpec(margin=0.0, duration=0.0, slip=0.0, force=0.0)
    halved = run("a", with_margin(0.5), half_step=True, agree=strict)
    made = compare([run("a", agree=strict), halved])
    assert made.agrees
    assert all(row.difference is None for row in made.rows), "no engines to compare"
    (found,) = compare([run("a"), run("a", with_margin(-0.01), half_step=True)]).disagreements
    assert (found.cause, found.runs, found.kind) == ("step", ("a", "a-half_step"), "expectation")


def test_engines_and_steps_are_compared_apart() -> None:
    good, bad = VERDICT, with_margin(-0.01)
    runs = [run("a", good), run("a", bad, half_step=True), run("b", good), run("b", good, half_step=True)]
    assert [found.cause for found in compare(runs).disagreements] == ["step"]
    runs = [run("a", good), run("a", good, half_step=True), run("b", bad), run("b", bad, half_step=True)]
    assert [found.cause for found in compare(runs).disagreements] == ["engines"]


def test_an_unlimited_margin_is_not_compared() -> None:
    made = compare([run("a", with_margin(math.inf), agree=AgreeSpec(margin=0.1)), run("b")])
    assert made.agrees


@given(
    margins=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    share=st.none() | st.floats(0.0, 2.0),
)
def test_the_order_of_the_engines_does_not_matter(margins: list[float], share: float | None) -> None:
    """Law: agreement is symmetric. Oracle: signs, and the largest difference of all pairs."""

    def made(order: tuple[int, ...]) -> Agreement:
        agree = AgreeSpec(margin=share)
        return compare([run(f"e{k}", with_margin(margins[k]), agree=agree) for k in order])

    found = [made(order).agrees for order in ((0, 1, 2), (2, 1, 0), (1, 2, 0))]
    signs = {margin >= 0.0 for margin in margins}
    pairs = [abs(a - b) for a in margins for b in margins]
    limit = math.inf if share is None else max(share * max(map(abs, margins)), 1e-3)
    assert found == [len(signs) == 1 and max(pairs) <= limit] * 3


def test_runs_in_which_nothing_was_done_are_not_compared() -> None:
    steps = tuple(replace(step, outcome="not_run", started=None, ended=None) for step in STEPS)
    unmet = tuple(replace(each, outcome="not_evaluated", margin=None, at=None) for each in (INSIDE, UPRIGHT))
    nothing = replace(VERDICT, verdict="failed", steps=steps, expectations=unmet, text="'cup' moved 31 mm")
    agreement = compare([run("a", nothing), run("b", nothing)])
    assert not agreement.judged
    assert compare([run("a", nothing), run("b")]).judged
    text = render_text(ComparedRuns(agreement, (RunReport(nothing, Timing()), RunReport(nothing, Timing()))))
    assert text.count("'cup' moved 31 mm") == 1
    assert text.endswith("a and b are not compared: no step was done in any run")


def test_a_number_without_a_limit_has_no_mark() -> None:
    lines = numbers_table(compare([run("a"), run("b")])).splitlines()
    assert [line for line in lines if "slip" in line and line.startswith("✓")] == []
    assert all(line.startswith("✓") for line in lines if "inside" in line)
