"""The text of a verdict: the cause first, margins in units that people use, words beside every mark."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from manipcli.conditions.robustness import EDGE
from manipcli.core.errors import Diagnostic, Place, Severity
from manipcli.core.units import readable
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.report.display_quantity import quantity
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.table import table
from manipcli.report.text import describe, render_findings, render_run, render_verdict

PASSED = Verdict(
    task="pour",
    verdict="passed",
    seed=7,
    engine="pybullet",
    simulated_time=20.5,
    steps=(StepOutcome("pick_1", "pick", "done", 0.0, 6.1, 5.9),),
    expectations=(ExpectationOutcome("near", "passed", 0.0041, "m", 17.32),),
)
FAILED = replace(
    PASSED,
    verdict="failed",
    steps=(*PASSED.steps, StepOutcome("lift_1", "lift", "failed", 6.1, 7.0, 2.0, "the hand lost the cup")),
    expectations=(ExpectationOutcome("upright", "failed", -math.radians(12), "rad", 19.0),),
)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0041, "m", "4.1 mm"),
        (1.5, "m", "1.5 m"),
        (math.radians(5), "rad", "5.0 deg"),
        (0.00002, "m", "0.02 mm"),
        (0.2345, "m", "234 mm"),
        (12.0, "N", "12.0 N"),
        (0.25, "s", "0.25 s"),
        (3.0, "", "3.0"),
        (math.inf, "m", "unlimited"),
        (-0.0, "N", "0 N"),
    ],
)
def test_quantities_are_in_customary_units(value: float, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


def test_what_a_done_step_reports_is_in_the_table_without_its_fingers() -> None:
    fingers = "finger of 'left': contact at 8 N (requested 8 N); finger of 'right': reached its target; at t = 0.100 s"
    pick = replace(PASSED.steps[0], text=fingers)
    assert "result" not in render_verdict(replace(PASSED, steps=(pick,)), "runs/pour.mcap")
    press = StepOutcome("press_1", "press", "done", 6.1, 8.0, 2.0, f"{fingers}; felt 9.9 N in the mean, 10 N at most")
    text = render_verdict(replace(PASSED, steps=(pick, press)), "runs/pour.mcap")
    assert [line.split("  ")[-1].strip() for line in text.splitlines()[:3]] == [
        "result",
        "5.90 s",
        "felt 9.9 N in the mean, 10 N at most",
    ]


def test_a_pass_says_how_much_there_was_to_spare() -> None:
    text = render_verdict(PASSED, "runs/pour.mcap")
    assert "passes with 4.1 mm to spare (tightest at 17.32 s)" in text
    assert "✓ pour passed: 1 of 1 step done, 1 of 1 expectation met" in text
    assert text.endswith("log: runs/pour.mcap")


def test_a_large_log_is_reported_with_its_size_and_what_thins_it() -> None:
    """Oracle: 180 MB in 90 s are 120 MB in a minute."""
    report = RunReport(replace(PASSED, simulated_time=90.0), Timing(simulate=1.0), log="a.mcap", log_size=180_000_000)
    lines = render_run(report).splitlines()
    assert lines[-2:] == [
        "size of the log: 180.0 MB, 120.0 MB per minute; `record: {rates: ...}` in the task thins it",
        "log: a.mcap",
    ]
    assert "size of the log" not in render_run(replace(report, log_size=1_000_000))
    assert "size of the log" not in render_run(replace(report, log_size=None))


def test_a_pass_with_nothing_to_spare_is_a_pass() -> None:
    outcome = ExpectationOutcome("no_collision", "passed", 0.0, "N", None, "never touched")
    assert "passes: never touched" in render_verdict(replace(PASSED, expectations=(outcome,)), "x")
    against = ExpectationOutcome("not", "failed", -EDGE, "N", None, "not never touched")
    assert "fails: not never touched" in render_verdict(replace(PASSED, expectations=(against,)), "x")
    assert readable(-0.0, "N") == "0 N"


def test_a_failure_begins_with_its_first_cause() -> None:
    lines = render_verdict(FAILED, "x.mcap").splitlines()
    assert lines[0] == "✗ step 'lift_1' failed: the hand lost the cup"
    assert lines[1] == "✗ expectation 'upright' fails by 12.0 deg (worst at 19.00 s)"


def test_a_run_that_never_began_says_why_and_nothing_else_first() -> None:
    steps = (replace(PASSED.steps[0], outcome="not_run", started=None, ended=None),)
    unmet = (replace(PASSED.expectations[0], outcome="not_evaluated", margin=None, at=None),)
    verdict = replace(PASSED, verdict="failed", steps=steps, expectations=unmet, text="'ball' moved by 90 mm")
    assert render_verdict(verdict, "x").splitlines()[:2] == ["✗ 'ball' moved by 90 mm", ""]


def test_an_expectation_that_was_never_evaluated_says_why() -> None:
    outcome = ExpectationOutcome("inside", "not_evaluated", None, "m", None, "the kinematic engine moves no ball")
    text = render_verdict(replace(PASSED, verdict="failed", expectations=(outcome,)), "x")
    assert "was never evaluated: the kinematic engine moves no ball" in text.splitlines()[0]


def test_a_task_without_expectations_says_so() -> None:
    assert "1 of 1 step done, no expectations" in render_verdict(replace(PASSED, expectations=()), "x")


def test_a_run_says_how_fast_it_was() -> None:
    report = RunReport(PASSED, Timing(0.1, 0.2, 2.5, 0.2), "x.mcap")
    assert "20.50 s simulated, 3.00 s real (8.2 x real time" in render_run(report)
    assert "plan 0.20 s" in render_run(report, verbose=True)


def test_findings_are_counted() -> None:
    findings = [Diagnostic("A1", "x"), Diagnostic("A2", "y", severity="warning", hint="z")]
    assert render_findings(findings, ["a", "b"]).splitlines() == [
        "error[A1]: x",
        "warning[A2]: y",
        "  hint: z",
        "more about a code: manipcli explain A1",
        "✗ failed: 2 files checked, 1 error, 1 warning",
    ]
    assert render_findings([], ["a"]) == "✓ passed: 1 file checked, 0 errors"


def test_what_is_the_same_in_the_rounds_of_a_loop_is_told_once_and_counted() -> None:
    def of(step: str, body: str, line: int, severity: Severity = "note", ratio: int = 16) -> Diagnostic:
        text = f"step '{step}': holds {ratio} x the weight of '{body}'"
        return Diagnostic("A1", text, Place("a.yaml", line, 1), severity=severity)

    findings = [of(f"sort[{k}]/take", "abcd"[k], 7, ratio=9 + k) for k in range(4)]
    alone = [of("take", "e", 9), of("take", "f", 9), of("sort[0]/take", "a", 8)]
    warned = [of(f"sort[{k}]/take", "ab"[k], 7, "warning", 9 + k) for k in range(2)]
    lines = render_findings([*findings, *alone, *warned], ["a.yaml"]).splitlines()
    assert lines == [f"{findings[0]}; and 3 more rounds", *map(str, alone), *map(str, warned), *lines[-2:]]
    assert lines[-1].endswith("2 warnings")


def test_columns_line_up_also_for_wide_characters_and_nothing_is_cut() -> None:
    long = "x" * 300
    lines = table(("a", "b"), [("茶碗", long), ("cup", "[bold]y[/bold]")], right=()).splitlines()
    assert lines == ["a     b", f"茶碗  {long}", "cup   [bold]y[/bold]"]


def test_no_name_forges_a_line_and_none_fills_the_screen() -> None:
    forged = "a\nx.urdf:1:1: error[URDF999]: forged"
    finding = Diagnostic("URDF331", f"link '{forged}' and '\u200b'", Place(f"{'d' * 5000}\n.urdf", 1, 2), hint=forged)
    lines = describe(finding).splitlines()
    assert len(lines) == 2 and lines[1].startswith("  hint: a\\nx.urdf")
    assert ":1:2: error[URDF331]: link 'a\\nx.urdf" in lines[0] and "'\\u200b'" in lines[0]
    assert len(lines[0]) < 500
