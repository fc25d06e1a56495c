"""JUnit XML: what readers of it expect, the counts, the places, and text that XML cannot hold."""

from __future__ import annotations

from dataclasses import replace
from xml.etree.ElementTree import Element, fromstring

import pytest

from manipcli.core.errors import Diagnostic
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.replay.cause import Written
from manipcli.report.junit import render_junit

HOSTILE = "<b>&\"'\x00\x1b[31m\ud800\uffff ]]> é 杯"
PASSED = Verdict(
    task="pour",
    verdict="passed",
    seed=1,
    engine="pybullet",
    simulated_time=14.549,
    steps=(StepOutcome("pick_1", "pick", "done", 0.0, 1.945, 1.943), StepOutcome("b", "lift", "done", 1.945, 2.6, 0.7)),
    expectations=(
        ExpectationOutcome("near", "passed", 0.0137, "m", 14.05, "object: cup"),
        ExpectationOutcome("step_done", "passed", None, "", None),
    ),
    text="all 2 steps done, all 2 expectations met",
)
FAILED = replace(
    PASSED,
    verdict="failed",
    steps=(*PASSED.steps[:1], replace(PASSED.steps[1], outcome="timeout", text="too slow"),
           StepOutcome("c", "wait", "not_run", None, None, 0.5)),
    expectations=(ExpectationOutcome("near", "failed", -0.016, "m", 2.74, "object: cup"),
                  ExpectationOutcome("inside", "not_evaluated", None, "m", None, "no physics")),
    text="step 'b' timeout: too slow",
)  # fmt: skip
ATTRIBUTES = {
    "testsuites": {"name", "tests", "failures", "errors", "time"},
    "testsuite": {"name", "tests", "failures", "errors", "skipped", "time"},
    "properties": set(),
    "property": {"name", "value"},
    "testcase": {"classname", "name", "time", "file", "line"},
    "failure": {"message", "type"},
    "error": {"message", "type"},
    "skipped": {"message"},
    "system-out": set(),
}
"""What readers have in common."""


def _read(verdict: Verdict, **options: str) -> Element:
    steps = tuple(Written(f"pour.yaml:{13 + k}", "task.yaml", 58 + k) for k in range(len(verdict.steps)))
    expectations = tuple(Written("", "task.yaml", 87 + k) for k in range(len(verdict.expectations)))
    root = fromstring(render_junit(verdict, steps, expectations, **options))
    for one in root.iter():
        assert set(one.keys()) <= ATTRIBUTES[one.tag], one.tag
    (suite,) = root
    assert suite[0].tag == "properties"
    cases = suite.findall("testcase")
    for kind, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        assert int(suite.get(kind, "")) == sum(case.find(tag) is not None for case in cases)
    assert int(suite.get("tests", "")) == len(cases)
    return suite


def _case(suite: Element, name: str) -> Element:
    return next(case for case in suite.findall("testcase") if case.get("name") == name)


def test_a_run_that_passed_is_a_case_a_step_and_an_expectation() -> None:
    suite = _read(PASSED, log="pour.mcap")
    names = [(case.get("classname"), case.get("name")) for case in suite.findall("testcase")]
    assert names == [("pour.run", "run"), ("pour.steps", "pick_1"), ("pour.steps", "b"), ("pour.expect", "near"),
                     ("pour.expect", "step_done")]  # fmt: skip
    assert (suite.get("failures"), suite.get("errors"), suite.get("skipped")) == ("0", "0", "0")
    assert _case(suite, "pick_1").get("time") == "1.945"
    assert "margin +0.0137 m" in str(_case(suite, "near").findtext("system-out"))
    untouched = replace(PASSED, expectations=(ExpectationOutcome("no_collision", "passed", -0.0, "N", None, "never"),))
    assert _case(_read(untouched), "no_collision").findtext("system-out") == "margin +0 N, never"


def test_a_failure_tells_the_margin_and_where_it_was_written() -> None:
    suite = _read(FAILED)
    step, near = _case(suite, "b"), _case(suite, "near").find("failure")
    failure = step.find("failure")
    assert failure is not None and near is not None
    assert (step.get("file"), step.get("line")) == ("pour.yaml", "14")
    assert failure.get("message") == "step 'b' timed out: too slow" and failure.get("type") == "timeout"
    assert "fails by 16.0 mm" in str(near.get("message")) and "margin -0.016 m\nat 2.740 s" in str(near.text)
    assert _case(suite, "c").find("skipped") is not None
    assert _case(suite, "near").get("file") is None  # the log does not say where


def test_the_file_is_called_as_ci_knows_it() -> None:
    assert _case(_read(FAILED, file="tasks/pour.yaml"), "b").get("file") == "tasks/pour.yaml"


def test_what_was_never_evaluated_is_excused_by_a_failed_step_only() -> None:
    assert _case(_read(FAILED), "inside").find("skipped") is not None
    alone = replace(FAILED, steps=PASSED.steps)
    assert _case(_read(alone), "inside").find("failure") is not None


@pytest.mark.parametrize("undone", [False, True])
def test_a_run_that_did_not_pass_never_looks_as_if_it_had(undone: bool) -> None:
    """The simulation blew up after the last step, or before the first."""
    steps = tuple(
        replace(step, outcome="not_run", started=None, ended=None) if undone else step for step in PASSED.steps
    )
    suite = _read(replace(PASSED, verdict="failed", steps=steps, text="the cup fell through the desk"))
    failure = _case(suite, "run").find("failure")
    assert failure is not None and failure.get("message") == "the cup fell through the desk"


def test_a_step_that_may_fail_does_not_fail_the_suite() -> None:
    tried = replace(PASSED.steps[1], outcome="failed", text="too far", tolerated=True)
    suite = _read(replace(PASSED, steps=(PASSED.steps[0], tried)))
    assert suite.get("failures") == "0"
    assert "too far" in str(_case(suite, "b").findtext("system-out"))


def test_an_interruption_is_an_error() -> None:
    finding = Diagnostic("RUN101", "the run was interrupted", hint="run it again")
    suite = _read(replace(FAILED, verdict="error", errors=(finding,), text="the run was interrupted"))
    error = _case(suite, "run").find("error")
    assert error is not None and error.get("type") == "RUN101" and "hint: run it again" in str(error.text)


def test_any_text_is_xml() -> None:
    steps = (StepOutcome(HOSTILE, HOSTILE, "failed", 0.0, None, 1.0, HOSTILE),)
    expectations = (ExpectationOutcome(HOSTILE, "failed", -1.0, HOSTILE, 1.0, HOSTILE),)
    suite = _read(replace(FAILED, task=HOSTILE, text=HOSTILE, steps=steps, expectations=expectations), log=HOSTILE)
    assert "<b>&\"'\\x00\\x1b[31m\\ud800\ufffd ]]> é 杯" in str(suite.get("name"))
