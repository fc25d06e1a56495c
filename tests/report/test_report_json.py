"""The JSON object of a run: its names are public, and it is JSON whatever the numbers are."""

from __future__ import annotations

import json
import math

import pytest

from manipcli.core.errors import Diagnostic, Place
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.report.json import render_errors, render_run, render_verdict
from manipcli.report.run_report import RunReport, Timing

VERDICT = Verdict(
    task="pour",
    verdict="failed",
    seed=7,
    engine="pybullet",
    simulated_time=0.1 + 0.2,
    steps=(
        StepOutcome("pick_1", "pick", "done", 0.0, 6.1, 5.9),
        StepOutcome("lift_1", "lift", "not_run", None, None, 2.0),
    ),
    expectations=(ExpectationOutcome("near", "failed", -0.01, "m", 20.1),),
)
REPORT = RunReport(VERDICT, Timing(0.1, 0.2, 2.5, 0.2), "runs/pour.mcap")


def test_the_documented_names_are_there() -> None:
    answer = json.loads(render_run(REPORT))
    assert set(answer) >= {
        "task", "verdict", "seed", "engine", "simulated_time", "wall_time", "real_time_factor", "log", "timing",
        "saturated", "steps", "expectations", "errors",
    }  # fmt: skip
    assert set(answer["timing"]) == {"load", "plan", "simulate", "judge"}
    assert set(answer["steps"][0]) >= {"id", "verb", "outcome", "started", "ended", "planned_duration"}
    assert set(answer["expectations"][0]) >= {"name", "outcome", "margin", "unit", "at"}
    assert answer["steps"][1]["started"] is None
    assert answer["simulated_time"] == 0.3


def test_run_judge_and_error_have_the_same_keys() -> None:
    error = Diagnostic("TASK1", "bad \x1b", Place("a.yaml", 3, 5), hint="h")
    objects = [
        json.loads(text) for text in (render_run(REPORT), render_verdict(VERDICT, "x.mcap"), render_errors([error]))
    ]
    assert len({tuple(one) for one in objects}) == 1
    assert objects[2]["errors"] == [
        {
            "severity": "error", "code": "TASK1", "file": "a.yaml", "line": 3, "column": 5, "message": "bad \x1b",
            "hint": "h",
        }
    ]  # fmt: skip


def test_judging_a_log_says_what_the_run_said() -> None:
    run, judged = json.loads(render_run(REPORT)), json.loads(render_verdict(VERDICT, REPORT.log))
    only_a_run_knows = {"wall_time", "real_time_factor", "timing"}
    assert {key for key in run if run[key] != judged[key]} == only_a_run_knows


@pytest.mark.parametrize("margin", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_null(margin: float) -> None:
    verdict = Verdict("t", "passed", 0, "kinematic", 1.0, (), (ExpectationOutcome("x", "passed", margin, "m", None),))
    assert json.loads(render_verdict(verdict, "x"))["expectations"][0]["margin"] is None


def test_of_a_file_as_a_whole_line_and_column_are_unknown() -> None:
    finding = Diagnostic("USE101", "there is no such file", Place("a.yaml", 0, 0))
    (error,) = json.loads(render_errors([finding]))["errors"]
    assert (error["file"], error["line"], error["column"]) == ("a.yaml", None, None)


def test_a_warning_among_the_errors_says_so() -> None:
    findings = [Diagnostic("A", "x"), Diagnostic("B", "y", severity="warning"), Diagnostic("C", "z", severity="note")]
    told = json.loads(render_errors(findings))["errors"]
    assert [(each["code"], each["severity"]) for each in told] == [("A", "error"), ("B", "warning"), ("C", "note")]
