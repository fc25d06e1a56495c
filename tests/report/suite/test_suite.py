"""Many runs told: in lines, as annotations, as JUnit, as JSON, as a page."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic, Place
from manipcli.judge.drawn import Drawn
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.report.html.case_page import render_case_page
from manipcli.report.html.suite_page import render_page
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.suite import suite_json
from manipcli.report.suite.github import render_annotations
from manipcli.report.suite.suite import (
    Case,
    CaseReport,
    CaseWord,
    Suite,
    Trouble,
    signal_name,
    troubles_of,
    warnings_of,
)
from manipcli.report.suite.suite_text import gist, render_case, render_line, render_suite, render_summary, slowest_lines

NEAR = ExpectationOutcome("near", "passed", 0.0156, "m", 14.5, relative=0.78)
UPRIGHT = ExpectationOutcome("upright", "passed", 0.0873, "rad", 14.4, relative=0.99)
FORCE = ExpectationOutcome("contact_force", "passed", 0.23, "N", 14.4, relative=0.04)
NEVER = ExpectationOutcome("no_collision", "passed", 0.0, "N", None, relative=0.0)
MISSED = ExpectationOutcome("inside", "failed", -0.003, "m", 14.0, "'ball' is beside 'tray'", relative=-0.12)
STEP = StepOutcome("pick_1", "pick", "done", 0.0, 2.0, 2.0)


def run(*expectations: ExpectationOutcome) -> RunReport:
    failed = any(one.outcome != "passed" for one in expectations)
    verdict = Verdict("pour", "failed" if failed else "passed", 1, "pybullet", 14.5, (STEP,), expectations)
    return RunReport(verdict, Timing(0.5, 0.5, 1.5, 0.5), log="runs/x.mcap")


def report(
    outcome: CaseWord, *expectations: ExpectationOutcome, sample: int | None = None, **more: object
) -> CaseReport:
    ran = run(*expectations) if outcome in ("passed", "failed") else None
    case = Case("tasks/pour.yaml", "pour", sample)
    return CaseReport(case, outcome, 3.5, "manipcli run tasks/pour.yaml", run=ran, **more)  # type: ignore[arg-type]


PASSED = report("passed", NEAR, UPRIGHT, NEVER)
FAILED = report(
    "failed", MISSED, NEAR, text="an expectation is not met", log="runs/test/tasks/pour.mcap",
    troubles=(Trouble("inside: fails by 3.0 mm: a, b: 100%\nso", Place("tasks/pour.yaml", 21, 5), 14.0),),
)  # fmt: skip
CRASHED = report(
    "crashed", text="crashed by signal 11 (SIGSEGV)", troubles=(Trouble("crashed by signal 11 (SIGSEGV)"),)
)


@pytest.mark.parametrize(
    ("judged", "tightest"),
    [
        ((UPRIGHT, NEAR, NEVER), NEAR),  # not what never touched
        ((NEAR, FORCE), FORCE),  # 4 % of its tolerance is left, of the other, which is less in SI numbers, 78 %
        ((NEAR, MISSED), MISSED),
        ((NEVER,), NEVER),
        ((NEAR, replace(MISSED, margin=None, relative=None)), NEAR),
    ],
)
def test_the_tightest_expectation(judged: tuple[ExpectationOutcome, ...], tightest: ExpectationOutcome) -> None:
    assert report("passed", *judged).tightest == tightest


def test_a_line_says_verdict_margin_and_time() -> None:
    assert render_line(PASSED) == "✓ passed   tasks/pour.yaml::pour    3.50 s  near: 15.6 mm to spare"
    assert render_line(FAILED) == "✗ failed   tasks/pour.yaml::pour    3.50 s  inside: fails by 3.0 mm"
    assert render_line(CRASHED).endswith("crashed by signal 11 (SIGSEGV)")
    assert gist(report("passed")) == "no expectations"
    long = report("crashed", troubles=(Trouble("x" * 500),))
    assert len(render_line(long)) < 170
    assert "x" * 500 in render_case(long)


def test_a_failure_says_where_what_held_and_how_to_see_it_again() -> None:
    lines = render_case(FAILED).splitlines()
    assert lines[0] == "✗ tasks/pour.yaml::pour failed"
    assert lines[1].startswith("  tasks/pour.yaml:21:5: inside: fails by 3.0 mm")
    assert "  ✓ near: 15.6 mm to spare" in lines
    assert lines[-2:] == ["  log: runs/test/tasks/pour.mcap", "  reproduce: manipcli run tasks/pour.yaml"]


@pytest.mark.parametrize(
    ("words", "total", "stopped", "code"),
    [
        (["passed", "passed"], 2, "", 0),
        (["passed", "failed"], 2, "", 1),
        (["crashed"], 1, "", 1),
        (["hung", "passed"], 2, "", 1),
        (["error"], 1, "", 1),
        (["failed", "invalid"], 2, "", 4),
        (["failed"], 2, "first failure", 1),
        (["passed"], 2, "interrupted", 2),
        ([], 2, "interrupted", 2),
        ([], 0, "", 5),
    ],
)
def test_the_exit_code_of_many(words: list[CaseWord], total: int, stopped: str, code: int) -> None:
    reports = tuple(report(word) for word in words)
    suite = Suite(reports, total, 2, 4.0, stopped)  # type: ignore[arg-type]
    assert suite.exit_code == code
    assert render_summary(suite).startswith("✓" if code == 0 else "✗")
    verdict = json.loads(suite_json.render_suite(suite))["verdict"]
    assert (verdict == "passed") == (code == 0)


def test_a_summary_counts_all() -> None:
    suite = Suite((PASSED, FAILED, CRASHED), 5, 2, 12.34, "first failure")
    assert render_summary(suite) == (
        "✗ 1 failed, 1 crashed, 1 passed, 2 not run in 12.3 s, 2 processes; stopped at the first failure"
    )
    assert render_suite(suite).count("reproduce: ") == 2


def test_annotations_are_what_github_reads(tmp_path: Path) -> None:
    told = render_annotations([PASSED, FAILED, CRASHED]).splitlines()
    assert told == [
        "::error file=tasks/pour.yaml,line=21,col=5,title=pour failed::inside: fails by 3.0 mm: a, b: 100%25%0Aso",
        "::error file=tasks/pour.yaml,line=1,col=1,title=pour crashed::crashed by signal 11 (SIGSEGV)",
    ]
    odd = replace(CRASHED, case=Case("a,b:c.yaml", "t"))
    assert "file=a%2Cb%3Ac.yaml," in render_annotations([odd])
    whole = replace(CRASHED, troubles=(Trouble("one\r\ntwo", Place("t.yaml", 3, 0)),))
    assert render_annotations([whole]) == "::error file=t.yaml,line=3,col=1,title=pour crashed::one%0D%0Atwo"


def test_what_a_word_of_the_command_line_does_is_told_with_the_task() -> None:
    wrong = [Diagnostic("TASK212", "there is no 'nope'", Place("--set scene.nope.x=1", 0, 0))]
    odd = report("invalid", troubles=troubles_of(wrong))
    assert render_annotations([odd]) == (
        "::error file=tasks/pour.yaml,line=1,col=1,title=pour invalid::"
        "--set scene.nope.x=1: error[TASK212]: there is no 'nope'"
    )


def test_annotations_name_files_from_the_top_of_the_checkout(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "project").mkdir()
    monkeypatch.chdir(tmp_path / "project")
    assert "file=project/tasks/pour.yaml," in render_annotations([FAILED], workspace=tmp_path)


def test_what_was_not_run_is_named() -> None:
    suite = Suite((), 2, 1, 1.0, "interrupted", undone=(Case("a.yaml", "a"), Case("b.yaml", "b", sample=3)))
    assert json.loads(suite_json.render_suite(suite))["not_run"] == ["a.yaml::a", "b.yaml::b[3]"]


def test_a_failure_tells_what_was_drawn_and_what_was_doubted_before_it_began() -> None:
    weak = Diagnostic("CTRL153", "joint_4: p 5", Place("weak.yaml", 12, 16), hint="d 3 gives 0.7", severity="warning")
    assert FAILED.run is not None
    drawn = replace(FAILED.run, verdict=replace(FAILED.run.verdict, drawn=Drawn(3, (("scene.cup.mass", 0.25),))))
    odd = replace(FAILED, run=drawn, warnings=(weak,))
    told = [
        "sample 3: scene.cup.mass=0.25",
        "weak.yaml:12:16: warning[CTRL153]: joint_4: p 5",
        "  hint: d 3 gives 0.7",
    ]
    lines = render_case(odd).splitlines()
    assert [line.removeprefix("  ") for line in lines[3:6]] == told
    assert all(line in render_page(Suite((odd,), 1, 1, 1.0), Path()) for line in told)
    (case,) = json.loads(suite_json.render_suite(Suite((odd,), 1, 1, 1.0)))["cases"]
    assert [(one["code"], one["hint"]) for one in case["warnings"]] == [("CTRL153", "d 3 gives 0.7")]


def test_a_page_tells_all_that_was_drawn_and_a_line_the_first_of_it() -> None:
    many = Drawn(3, tuple((f"scene.body_{k}.mass", 0.25) for k in range(9)))
    assert FAILED.run is not None
    run = replace(FAILED.run, verdict=replace(FAILED.run.verdict, drawn=many))
    odd = replace(FAILED, run=run)
    assert "scene.body_7.mass=0.25, and 1 more" in render_case(odd)
    for page in (render_page(Suite((odd,), 1, 1, 1.0), Path()), render_case_page(odd, Path())):
        assert "scene.body_8.mass=0.25" in page
        assert "and 1 more" not in page


def test_what_is_wrong_with_a_file_is_told_once_for_all_samples() -> None:
    wrong = (Diagnostic("TASK201", "unknown key", Place("tasks/pour.yaml", 3, 4)),)
    own = (Diagnostic("SCN101", "too heavy (sample 2)", Place("tasks/pour.yaml", 3, 4)),)
    invalid = tuple(
        report("invalid", sample=k, findings=why, troubles=troubles_of(why))
        for k, why in enumerate([wrong, wrong, own])
    )
    suite = Suite(invalid, 3, 1, 1.0)
    assert [line for line in render_suite(suite).splitlines() if line.startswith("✗")] == [
        "✗ tasks/pour.yaml::pour[0] invalid", "✗ tasks/pour.yaml::pour[2] invalid", "✗ 3 invalid in 1.0 s, 1 process",
    ]  # fmt: skip
    assert len(render_annotations(invalid).splitlines()) == 2


def test_what_else_there_is_to_know_stands_above_the_summary() -> None:
    suite = Suite((PASSED,), 1, 1, 1.0, notes=("not compared",))
    assert render_suite(suite).splitlines() == ["not compared", "✓ 1 passed in 1.0 s, 1 process"]
    assert json.loads(suite_json.render_suite(suite))["notes"] == ["not compared"]


def test_json_tells_of_each_case_what_a_run_tells() -> None:
    answer = json.loads(suite_json.render_suite(Suite((PASSED, FAILED, CRASHED), 3, 2, 9.0)))
    assert (answer["verdict"], answer["total"], answer["passed"]) == ("failed", 3, 1)
    passed, failed, crashed = answer["cases"]
    assert passed["tightest"] == {"name": "near", "margin": 0.0156, "unit": "m"}
    assert passed["run"]["verdict"] == "passed"
    assert (failed["troubles"][0]["line"], failed["troubles"][0]["column"], failed["troubles"][0]["at"]) == (21, 5, 14)
    assert (crashed["run"], crashed["outcome"]) == (None, "crashed")


def test_the_page_leads_to_the_others_and_escapes_what_it_shows(tmp_path: Path) -> None:
    odd = replace(FAILED, case=Case("a<b>.yaml", "x&y"), page=str(tmp_path / "sub" / "a b.html"))
    page = render_page(Suite((PASSED, odd), 2, 2, 9.0), tmp_path)
    assert 'href="sub/a%20b.html"' in page
    assert "a&lt;b&gt;.yaml" in page
    assert "x&amp;y" in page
    assert page.index("a&lt;b") < page.index("tasks/pour.yaml")  # what failed comes first
    assert 'class="scroll stacks"' in page  # no column is cut off where it is narrow
    assert not re.findall(r'(?:src|href)="(?!data:|sub/|#)', page)


def test_the_page_leads_to_a_file_whose_name_is_no_text(tmp_path: Path) -> None:
    odd = replace(CRASHED, page=str(tmp_path / "p\udcf6.html"), log=str(tmp_path / "p\udcf6.mcap"))
    assert 'href="p%F6.html"' in render_page(Suite((odd,), 1, 1, 9.0), tmp_path)
    assert 'href="p%F6.mcap"' in render_case_page(odd, tmp_path)


def test_findings_become_troubles_with_places_and_hints() -> None:
    place = Place("a.yaml", 2, 3)
    assert troubles_of([Diagnostic("TASK203", "no joint 'x'", place, hint="did you mean 'y'?")]) == (
        Trouble("error[TASK203]: no joint 'x' (hint: did you mean 'y'?)", place),
    )


def test_what_ends_nothing_is_no_trouble() -> None:
    note = Diagnostic("URDF031", "link 'tip' has mass 0", Place("arm.urdf", 2, 3), severity="note")
    wrong = Diagnostic("ROBOT306", "no link 'x'", Place("robot.yaml", 6, 3))
    assert [one.message for one in troubles_of([note, wrong])] == ["error[ROBOT306]: no link 'x'"]
    assert warnings_of([note, wrong]) == (note,)


def test_the_page_tells_all_that_is_wrong_with_what_has_no_page_of_its_own() -> None:
    wrong = [
        Diagnostic("TASK201", text, Place("a.yaml", k, 1)) for k, text in enumerate(("unknown key", "no number"), 1)
    ]
    page = render_page(Suite((report("invalid", troubles=troubles_of(wrong)),), 1, 1, 1.0), Path())
    assert page.index("unknown key") < page.index("no number")


def test_signals_have_names() -> None:
    assert signal_name(11) == "signal 11 (SIGSEGV)"
    assert signal_name(200) == "signal 200"


def test_the_slowest_come_first() -> None:
    reports = tuple(replace(PASSED, duration=seconds) for seconds in (1.0, 30.25, 2.0))
    suite = Suite(reports, total=3, jobs=1, duration=33.0)
    assert slowest_lines(suite, 2) == ("  30.25 s  tasks/pour.yaml::pour", "   2.00 s  tasks/pour.yaml::pour")
    assert len(slowest_lines(suite, 0)) == 3
