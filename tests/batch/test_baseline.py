"""Baselines: what is worse than it was by more than is tolerated fails, and nothing else does."""

from __future__ import annotations

import html
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.batch.baseline import (
    Key,
    Measure,
    Measures,
    baseline_path,
    compared,
    kept_baseline,
    measured,
    read_baseline,
    write_baseline,
)
from manipcli.cli.app import main
from manipcli.core.errors import InvalidInput
from manipcli.judge.measures import step_measures
from manipcli.judge.measures.floors import FLOORS
from manipcli.judge.measures.step_measures import StepMeasures
from manipcli.pipeline import run_task
from manipcli.spec.baseline import ToleranceSpec

ROOT = Path(__file__).parents[2]
OLD: Measures = {
    ("duration",): Measure(10.0, "s"),
    ("steps", "pick_1"): Measure(2.0, "s"),
    ("energy",): Measure(50.0, "J"),
    ("margins", "near"): Measure(0.016, "m"),
    ("margins", "collision"): Measure(-0.0, "N"),
}
DEFAULT = ToleranceSpec()


@pytest.mark.parametrize(
    ("key", "within", "beyond", "better"),
    [
        (("duration",), 10.49, 10.51, 9.4),
        (("steps", "pick_1"), 2.09, 2.11, 1.8),
        (("energy",), 54.9, 55.1, 44.0),
        (("margins", "near"), 0.0121, 0.0119, 0.021),
        (("margins", "collision"), -0.4, -0.6, 1.0),
    ],
)
def test_only_what_is_worse_by_more_than_its_share_is_worse(
    key: Key, within: float, beyond: float, better: float
) -> None:
    unit = OLD[key].unit
    assert compared(OLD, OLD | {key: Measure(within, unit)}, DEFAULT) == ()
    (worse,) = compared(OLD, OLD | {key: Measure(beyond, unit)}, DEFAULT)
    assert (worse.key, worse.worse) == (key, True)
    (good,) = compared(OLD, OLD | {key: Measure(better, unit)}, DEFAULT)
    assert (good.key, good.worse) == (key, False)


def test_tasks_beside_each_other_share_no_baseline() -> None:
    tasks = [Path("t", name) for name in ("a.yaml", "a.yml", "a.YAML", "a@yml.yaml", "a@@yml.yaml", "index.yaml")]
    assert len({baseline_path(task) for task in tasks}) == len(tasks)
    assert baseline_path(tasks[0]) == Path("t/a.baseline.json")
    assert baseline_path(tasks[1]) == Path("t/a@yml.baseline.json")
    assert baseline_path(tasks[5]) == Path("t/index.baseline.json")


@pytest.mark.parametrize(
    ("name", "beside", "read"),
    [
        ("a.yml", [], "a@yml"),
        ("a.yml", ["a.baseline.json", "a.mcap"], "a"),
        ("a.yml", ["a.baseline.json", "a@yml.baseline.json"], "a@yml"),
        ("a.yml", ["a.baseline.json", "a.yaml"], "a@yml"),
        ("a.yml", ["a.baseline.json", "a.YML"], "a@yml"),
        ("a.yaml", ["a.yml"], "a"),
        ("a@b.yaml", ["a@b.baseline.json"], "a@b"),
        ("a@yml.yaml", ["a@yml.baseline.json", "a.yml"], "a@@yml"),
    ],
)
def test_a_baseline_of_an_earlier_name_is_read_where_it_is_that_of_no_other_task(
    tmp_path: Path, name: str, beside: list[str], read: str
) -> None:
    for one in (name, *beside):
        (tmp_path / one).touch()
    assert kept_baseline(tmp_path / name) == tmp_path / f"{read}.baseline.json"


def test_the_tolerance_is_the_tasks() -> None:
    new = OLD | {("duration",): Measure(10.6, "s")}
    assert compared(OLD, new, ToleranceSpec(duration=0.07)) == ()
    assert len(compared(OLD, new, ToleranceSpec(duration=0.0))) == 1


@given(st.sampled_from(sorted(FLOORS)), st.floats(0.0, 0.99), st.floats(-1.0, 1.0))
def test_what_is_too_small_to_mean_anything_never_counts(unit: str, share: float, old: float) -> None:
    before: Measures = {("margins", "x"): Measure(old * FLOORS[unit], unit)}
    after: Measures = {("margins", "x"): Measure((old - share) * FLOORS[unit], unit)}
    assert compared(before, after, ToleranceSpec(margin=0.0)) == ()


def test_what_is_no_longer_measured_is_worse_and_what_is_new_is_not() -> None:
    (gone,) = compared(OLD, {key: one for key, one in OLD.items() if key != ("margins", "near")}, DEFAULT)
    assert gone.worse
    assert str(gone).startswith("the margin of 'near' is missing; its baseline is 16.0 mm; `manipcli bless`")
    assert compared(OLD, OLD | {("margins", "other"): Measure(1.0, "m")}, DEFAULT) == ()


def test_a_margin_that_another_part_decides_cannot_be_compared_and_fails() -> None:
    (change,) = compared(OLD, OLD | {("margins", "near"): Measure(0.05, "rad")}, DEFAULT)
    assert (change.worse, change.word) == (True, "not comparable with")
    assert str(change) == (
        "the margin of 'near' is 2.9 deg; its baseline is 16.0 mm: another part of the condition decides; "
        "`manipcli bless` writes a new baseline"
    )


def test_old_and_new_are_told() -> None:
    (change,) = compared(OLD, OLD | {("steps", "pick_1"): Measure(2.4, "s")}, DEFAULT)
    assert str(change) == "step 'pick_1' takes 2.40 s; its baseline is 2.00 s (20 % longer)"


def test_a_baseline_reads_back_and_its_bytes_do_not_depend_on_order(tmp_path: Path) -> None:
    one, other = tmp_path / "one.json", tmp_path / "other.json"
    write_baseline(one, OLD)
    write_baseline(other, dict(reversed(OLD.items())))
    assert read_baseline(one) == OLD
    assert one.read_bytes() == other.read_bytes()
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
    assert read_baseline(tmp_path / "none.json") is None


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        "{}",
        '{"duration": 1.0}',
        '{"duration": "x", "margins": {}, "steps": {}}',
        '{"duration": 1.0, "margins": {"a": 1}, "steps": {}}',
        '{"duration": 1e999, "margins": {}, "steps": {}}',
        '{"duration": true, "margins": {}, "steps": {}}',
        f'{{"duration": {"9" * 400}, "margins": {{}}, "steps": {{}}}}',
        f'{{"duration": 1.0, "margins": {{}}, "steps": {{"a": {"9" * 400}}}}}',
        "[" * 100_000,
        '{"duration": NaN, "margins": {}, "steps": {}}',
        '{"duration": 1.0, "margins": {}, "steps": {}, "speed": 1}',
    ],
)
def test_what_is_no_baseline_is_told(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.baseline.json"
    path.write_text(text)
    with pytest.raises(InvalidInput, match="the file is not a baseline"):
        read_baseline(path)


TASK = f"""task: nod
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
simulation: {{engine: kinematic}}
steps:
  - move: {{to: {{pitch: 0.3}}}}
expect:
  - duration: {{below: 20 s}}
"""


def test_what_a_run_took_is_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "nod.yaml").write_text(TASK)
    log = tmp_path / "nod.mcap"
    report = run_task(tmp_path / "nod.yaml", log=log)
    found = measured(report.verdict, log)
    (step,) = report.verdict.steps
    assert step.started is not None
    assert step.ended is not None
    assert found["steps", "move_1"].value == step.ended - step.started > 0.1
    assert found["duration",].value == report.verdict.simulated_time
    assert found["margins", "duration"] == Measure(20.0 - report.verdict.simulated_time, "s")
    nothing = StepMeasures("s", "move", "done", None, None, None, None, None, "", None)
    for works, energy in (((3.0, None, 4.5, 0.25), Measure(7.75, "J")), ((None,), None)):
        steps = tuple(replace(nothing, work=work) for work in works)
        monkeypatch.setattr(step_measures, "step_measures", lambda *_, steps=steps: steps)
        assert measured(report.verdict, log).get(("energy",)) == energy, "that of all steps together"


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_bless_then_test_passes_until_something_is_worse(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    task = tmp_path / "nod.yaml"
    task.write_text(TASK)
    assert main(["bless", "nod.yaml"]) == 0
    assert "1 margin; written: nod.baseline.json" in capsys.readouterr().out
    blessed = baseline_path(task).read_bytes()
    assert main(["bless"]) == 0
    assert "unchanged within 0.05 s, " in capsys.readouterr().out
    assert main(["bless", "--format", "json"]) == 0
    (case,) = json.loads(capsys.readouterr().out)["cases"]
    assert (case["id"], case["outcome"], case["log"]) == ("nod.yaml::nod", "passed", None)
    assert case["notes"][0].endswith("written: nod.baseline.json")
    assert baseline_path(task).read_bytes() == blessed
    assert main(["test"]) == 0
    capsys.readouterr()

    old = json.loads(blessed)
    baseline_path(task).write_text(json.dumps({**old, "duration": 10.0}))
    assert main(["test"]) == 0
    assert "better than the baseline: the task takes" in capsys.readouterr().out

    old["steps"]["move_1"] /= 2.0
    baseline_path(task).write_text(json.dumps(old))
    assert main(["test", "--junit", "j.xml", "--report", "pages"]) == 1
    out = capsys.readouterr().out
    assert "nod.yaml:6:5: worse than the baseline: step 'move_1' takes" in out
    assert "(100 % longer)" in out
    (failure,) = ET.parse(tmp_path / "j.xml").getroot().iter("failure")
    assert "step 'move_1' takes" in str(failure.get("message"))
    page, index = (html.unescape((tmp_path / "pages" / f"{name}.html").read_text()) for name in ("nod", "index"))
    assert "<title>✗ nod failed</title>" in page
    assert "Why it failed" in page
    assert all("worse than the baseline: step 'move_1' takes" in one for one in (page, index))
    assert all(f"its baseline is {old['steps']['move_1']:.2f} s" in one for one in (page, index))
    assert main(["test", "--set", "simulation.seed=1"]) == 0  # not the task as it is written
    assert "1 test not compared with the baseline: " in capsys.readouterr().out

    baseline_path(task).write_text("{")
    assert main(["test", "--junit", "j.xml", "--report", "pages"]) == 1
    assert "nod.baseline.json: error[USE087]: the file is not a baseline" in capsys.readouterr().out
    assert "the file is not a baseline" in (tmp_path / "pages" / "nod.html").read_text()
    (failure,) = ET.parse(tmp_path / "j.xml").getroot().iter("failure")
    assert "the file is not a baseline" in str(failure.get("message"))
    baseline_path(task).write_text(json.dumps(old))

    task.write_text(TASK + "baseline: {tolerance: {duration: 150 %}}\n")
    assert main(["test"]) == 0
    task.write_text(TASK.replace("20 s", "10 ms"))
    assert main(["bless"]) == 1
    assert "baseline not written" in capsys.readouterr().out
    assert main(["bless", "--format", "json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["verdict"], answer["cases"][0]["outcome"]) == ("failed", "failed")
    assert json.loads(baseline_path(task).read_bytes()) == old
