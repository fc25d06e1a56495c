"""Tests of a task in several engines and steps: their ids, files and commands, and the report of their agreement."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Literal

import pytest

from manipcli.batch.discovery import read_case, samples_of, variants_of_case
from manipcli.batch.job import Job, Settings
from manipcli.batch.variants import agreement_report, in_engine, measured, with_step
from manipcli.cli.app import main
from manipcli.core.errors import Diagnostic, InvalidInput, Loc, Place
from manipcli.judge.measured_run import MeasuredRun, Variant
from manipcli.judge.verdict import ExpectationOutcome, Verdict
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.suite.suite import Case, CaseReport
from manipcli.report.suite.suite_text import gist, render_case
from manipcli.spec.agree import AgreeSpec
from manipcli.task.variants import overrides_of

CASE = Case("tasks/pour.yaml", "pour", tags=("slow", "engine_pybullet"), varied=True)
JOB = Job(CASE, Path("tasks/pour.yaml"), Settings())
NEAR = ExpectationOutcome("near", "passed", 0.01, "m", 1.0, relative=0.5)
TASK = """\
task: nod
robot: r.yaml
controllers: c.yaml
simulation: {step: 2 ms, control_period: 4 ms}
steps:
  - wait: 1 s
"""


def verdict(engine: str, margin: float) -> Verdict:
    word: Literal["passed", "failed"] = "passed" if margin >= 0.0 else "failed"
    near = replace(NEAR, margin=margin, outcome=word)
    return Verdict("pour", word, 0, engine, 1.0, (), (near,))


def ended(case: Case, margin: float, *, agree: AgreeSpec | None = None) -> CaseReport:
    assert case.variant is not None
    judged = verdict(case.variant.engine, margin)
    places: dict[Loc, Place] = {("judged", 0): Place(case.file, 9, 5)}
    numbers = MeasuredRun(case.variant, judged, 1e-3, 1.0, log="a.mcap", agree=agree or AgreeSpec(), places=places)
    word: Literal["passed", "failed"] = "passed" if margin >= 0.0 else "failed"
    return CaseReport(case, word, 1.0, "", run=RunReport(judged, Timing(), "a.mcap"), measured=numbers)


def test_ids_name_sample_engine_and_step() -> None:
    found = variants_of_case(replace(CASE, sample=3), ("pybullet", "mujoco"), check_step=True)
    assert [case.name for case in found] == [
        "pour[3-pybullet]", "pour[3-pybullet-half_step]", "pour[3-mujoco]", "pour[3-mujoco-half_step]",
        "pour[3-agreement]",
    ]  # fmt: skip
    assert [case.tags for case in found[1:3]] == [("slow", "engine_pybullet"), ("slow", "engine_mujoco")]
    assert found[-1].tags == ("slow", "agreement")
    assert [case.id for case in found[-1].runs] == [case.id for case in found[:-1]]


def test_without_engines_the_step_of_the_own_engine_is_checked() -> None:
    assert variants_of_case(CASE, (), check_step=False) == (CASE,)
    found = variants_of_case(CASE, (), check_step=True)
    assert [case.variant for case in found] == [Variant("pybullet"), Variant("pybullet", half_step=True), None]


def test_a_file_that_cannot_be_read_is_one_case() -> None:
    bad = replace(CASE, findings=(Diagnostic("YAML101", "bad"),))
    assert variants_of_case(bad, ("pybullet", "mujoco"), check_step=True) == (bad,)


@pytest.mark.parametrize("name", ["pour[3]", "pour[3-mujoco]", "pour[3-agreement]"])
def test_a_named_sample_is_found_with_its_engine(name: str) -> None:
    assert [case.sample for case in samples_of(CASE, None, {name, "pour[mujoco]", "pour[x3]"})] == [None, 3]


def test_every_run_has_its_own_files() -> None:
    cases = [
        case
        for sample in (CASE, replace(CASE, sample=3))
        for case in variants_of_case(sample, ("pybullet", "mujoco"), check_step=True)
    ]
    logs = {replace(JOB, case=case).log for case in (CASE, *cases)}
    assert len(logs) == 1 + len(cases)
    assert Path("runs/test/tasks/pour@3-mujoco.mcap") in logs


def test_commands_repeat_the_run() -> None:
    def options(case: Case) -> list[str]:
        return shlex.split(in_engine(case, JOB.path, JOB.settings).command())[3:]

    pybullet, halved, mujoco, _, agreement = variants_of_case(CASE, ("pybullet", "mujoco"), check_step=True)
    assert options(pybullet) == ["--set", "simulation.engine=pybullet"]
    assert options(halved) == ["--set", "simulation.engine=pybullet", "--check-step"]
    assert options(mujoco) == ["--set", "simulation.engine=mujoco"]
    assert options(agreement) == ["--engines", "pybullet,mujoco", "--check-step"]
    assert not replace(JOB, case=pybullet).nominal, "a baseline is for the task as written"


def test_half_the_step_keeps_the_control_period(tmp_path: Path) -> None:
    file = tmp_path / "nod.yaml"
    file.write_text(TASK)
    assert overrides_of(Variant("mujoco"), file) == ("simulation.engine=mujoco",)
    halved = overrides_of(Variant("mujoco", half_step=True), file, overrides=("simulation.step=1 ms",))
    assert halved == ("simulation.step=1 ms", "simulation.engine=mujoco", "simulation.step=0.0005")
    job = with_step(in_engine(replace(CASE, variant=Variant("kinematic", half_step=True)), file, Settings()))
    assert job.settings.overrides == ("simulation.engine=kinematic", "simulation.step=0.001")


def test_runs_agree_or_differ_with_both_numbers_and_the_place() -> None:
    *runs, agreement = variants_of_case(CASE, ("pybullet", "mujoco"), check_step=False)
    job = replace(JOB, case=agreement)
    good = agreement_report(job, [ended(runs[0], 0.012), ended(runs[1], 0.002)])
    assert (good.outcome, gist(good)) == ("passed", "pybullet and mujoco agree: all passed")
    bad = agreement_report(job, [ended(runs[0], 0.012), ended(runs[1], -0.003)])
    assert bad.outcome == "differs"
    (trouble,) = bad.troubles
    assert trouble.place == Place("tasks/pour.yaml", 9, 5)
    assert trouble.message == (
        "engines disagree: 'near' passed with 12.0 mm to spare with pybullet, failed by 3.0 mm with mujoco"
    )
    assert "-3.0 mm failed" in render_case(bad)


def test_runs_that_differ_by_more_than_is_allowed() -> None:
    *runs, agreement = variants_of_case(CASE, ("pybullet", "mujoco"), check_step=False)
    agree = AgreeSpec(margins={"near": "4 mm"})
    found = agreement_report(replace(JOB, case=agreement), [ended(runs[0], 0.012, agree=agree), ended(runs[1], 0.002)])
    assert [trouble.message for trouble in found.troubles] == [
        "engines disagree: the margin of 'near' is 12.0 mm with pybullet and 2.0 mm with mujoco: they differ by "
        "10.0 mm; `agree:` allows 4.0 mm"
    ]


def test_the_page_of_an_agreement_links_those_of_its_runs(tmp_path: Path) -> None:
    *runs, agreement = variants_of_case(CASE, ("pybullet", "mujoco"), check_step=False)
    job = replace(JOB, case=agreement, settings=Settings(pages=tmp_path))
    reports = [
        replace(ended(run, margin), page=str(replace(job, case=run).page))
        for run, margin in zip(runs, (0.01, -0.01), strict=True)
    ]
    found = agreement_report(job, reports)
    assert found.page == str(tmp_path / "tasks" / "pour@agreement.html")
    page = Path(found.page).read_text("utf-8")
    assert [link in page for link in ('href="pour%40mujoco.html"', 'href="../index.html"')] == [True, True]
    assert "engines disagree: " in page


def test_a_run_without_a_verdict_is_not_compared() -> None:
    *runs, agreement = variants_of_case(CASE, ("pybullet", "mujoco"), check_step=False)
    refused = CaseReport(runs[1], "invalid", 0.1, "", findings=(Diagnostic("SIM131", "no restitution"),))
    found = agreement_report(replace(JOB, case=agreement), [ended(runs[0], 0.012), refused])
    assert (found.outcome, found.text) == ("error", "not compared: 'pour[mujoco]' is invalid")


def test_an_amount_in_another_unit_is_no_agreement() -> None:
    *runs, agreement = variants_of_case(CASE, ("pybullet", "mujoco"), check_step=False)
    agree = AgreeSpec(margins={"near": "2 deg"})
    found = agreement_report(replace(JOB, case=agreement), [ended(runs[0], 0.012, agree=agree), ended(runs[1], 0.012)])
    assert (found.outcome, found.text) == (
        "differs",
        "a limit cannot be used: agree.margins.near: '2 deg' is an angle; the margin is in m",
    )


def test_places_have_the_shown_name_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "."]) == 0
    path = next(tmp_path.glob("**/*task*.yaml"), None) or next(iter((tmp_path / "tasks").glob("*.yaml")))
    shown = str(path.relative_to(tmp_path))
    case = replace(read_case(path, shown=shown), variant=Variant("kinematic"))
    report = RunReport(replace(verdict("kinematic", 0.1)), Timing())
    run = measured(with_step(in_engine(case, path, Settings())), report)
    assert run is not None
    assert {place.file for place in run.places.values()} == {shown}


def test_an_invalid_task_has_no_variant(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("task: bad\nrobot: 3\n")
    with pytest.raises(InvalidInput):
        with_step(replace(JOB, path=file, case=replace(CASE, variant=Variant("mujoco", half_step=True))))
