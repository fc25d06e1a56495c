"""Why a run did not pass stands at the line that says what was broken, in an annotation as in JUnit."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from manipcli.batch.baseline import Measure, baseline_path, write_baseline
from manipcli.batch.failure_report import against_baseline, draw, troubles
from manipcli.batch.job import Job, Settings
from manipcli.batch.process import run_job
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.report.suite.suite import Case

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: nod
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
steps:
  - wait: 1 s
watch:
  - always: {{tracking: {{group: wrist, within: 0.1 rad}}}}
expect:
  - duration: {{below: 20 s}}
"""
VERDICT = Verdict(
    task="nod", verdict="failed", seed=1, engine="kinematic", simulated_time=1.0,
    steps=(StepOutcome("wait_1", "wait", "done", started=0.0, ended=1.0, planned_duration=1.0),),
    expectations=(
        ExpectationOutcome("duration", "passed", 19.0, "s", 1.0),
        ExpectationOutcome("tracking", "failed", -0.1, "rad", 0.5),
    ),
)  # fmt: skip


def job(tmp_path: Path) -> Job:
    (tmp_path / "nod.yaml").write_text(TASK)
    return Job(Case("t/nod.yaml", "nod"), tmp_path / "nod.yaml", Settings(folder=tmp_path))


def test_a_broken_watch_is_told_at_its_line(tmp_path: Path) -> None:
    (trouble,) = troubles(job(tmp_path), VERDICT)
    assert str(trouble.place) == "t/nod.yaml:7:5"


@pytest.mark.parametrize(
    ("changes", "places"),
    [
        ({"outcome": "failed"}, ["5:5", "7:5"]),
        ({"outcome": "failed", "tolerated": True}, ["7:5"]),
        ({"outcome": "failed", "started": None, "ended": None}, ["5:5"]),  # refused: nothing ran that could be judged
    ],
)
def test_only_what_is_a_reason_is_a_trouble(tmp_path: Path, changes: dict[str, Any], places: list[str]) -> None:
    verdict = replace(VERDICT, steps=(replace(VERDICT.steps[0], **changes),))
    assert [str(one.place) for one in troubles(job(tmp_path), verdict)] == [f"t/nod.yaml:{at}" for at in places]
    assert troubles(job(tmp_path), replace(verdict, verdict="passed")) == ()


def test_why_a_run_ended_before_its_first_step_comes_first(tmp_path: Path) -> None:
    """No step failed, and what was never evaluated is a consequence."""
    steps = (replace(VERDICT.steps[0], outcome="not_run", started=None, ended=None),)
    unknown = tuple(
        ExpectationOutcome(one.name, "not_evaluated", None, "", None, "the recording holds no state")
        for one in VERDICT.expectations
    )
    verdict = replace(VERDICT, steps=steps, expectations=unknown, text="joint 'roll' runs away")
    first, *others = troubles(job(tmp_path), verdict)
    assert (first.message, first.place) == ("joint 'roll' runs away", None)
    assert [str(one.place) for one in others] == ["t/nod.yaml:9:5", "t/nod.yaml:7:5"]


def test_a_watch_that_is_worse_than_it_was_is_told_at_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = job(tmp_path)
    old, new = ({("duration",): Measure(1.0, "s"), ("margins", "tracking"): Measure(at, "rad")} for at in (0.3, 0.1))
    monkeypatch.setattr("manipcli.batch.failure_report.measured", lambda *_: new)
    assert against_baseline(one, VERDICT) == ((), [])
    write_baseline(baseline_path(one.path), old)
    ((trouble,), notes) = against_baseline(one, VERDICT)
    assert (str(trouble.place), notes) == ("t/nod.yaml:7:5", [])


def test_a_yml_is_compared_with_a_baseline_of_the_earlier_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = job(tmp_path)
    one = replace(one, path=one.path.rename(tmp_path / "nod.yml"))
    write_baseline(tmp_path / "nod.baseline.json", {("duration",): Measure(1.0, "s")})
    monkeypatch.setattr("manipcli.batch.failure_report.measured", lambda *_: {("duration",): Measure(2.0, "s")})
    ((trouble,), _) = against_baseline(one, VERDICT)
    assert "the task takes 2.00 s; its baseline is 1.00 s" in trouble.message


@pytest.mark.slow
def test_picture_and_page_are_drawn_with_the_meshes_of_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the folder of the task, as `cd tasks; manipcli test` is: the robot is in another one."""
    shutil.copytree(ROOT / "robots" / "arm7_hand3", tmp_path / "robots" / "arm7_hand3")
    (tmp_path / "tasks").mkdir()
    monkeypatch.chdir(tmp_path / "tasks")
    robot, controllers = "../robots/arm7_hand3/robot.yaml", f"{ROOT}/controllers/arm7_hand3.yaml"
    expect = "expect: [{duration: {below: 1 ms}}]\n"
    text = f"task: a\nrobot: {robot}\ncontrollers: {controllers}\nsteps: [{{wait: 1 ms}}]\n{expect}"
    Path("a.yaml").write_text(text)
    settings = Settings(folder=Path("runs/test"), pages=Path("pages"))
    report = run_job(Job(Case("a.yaml", "a"), Path("a.yaml"), settings))
    assert (report.outcome, report.notes) == ("failed", ())
    assert report.log is not None and report.picture is not None and report.page is not None
    with_meshes, without = tmp_path / "with.png", tmp_path / "without.png"
    draw(Path(report.log), with_meshes, at=report.troubles[0].at, package_path=[tmp_path / "robots"])
    draw(Path(report.log), without, at=report.troubles[0].at)
    assert Path(report.picture).read_bytes() == with_meshes.read_bytes() != without.read_bytes()
    assert "package-path" not in Path(report.page).read_text("utf-8")
