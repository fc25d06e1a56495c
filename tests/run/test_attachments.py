"""A suction cup without a hand picks and places; what it cannot hold falls, and every result names it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.pipeline import load_task, plan_task, run_task
from manipcli.record.read.reading import open_recording
from manipcli.report.json import render_run
from manipcli.report.junit import render_junit
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.text import render_verdict
from tests.run.gantry import PLACE, mass, written

CUP = f"""<link name="palm">{mass(0.2, 0.001)}<collision><origin xyz="0 0 -0.03"/>
  <geometry><cylinder radius="0.012" length="0.06"/></geometry></collision></link>"""


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_a_cup_picks_and_places_and_every_result_names_it(tmp_path: Path, engine: str) -> None:
    file = written(tmp_path, CUP, engine=engine, holding="{suction: {force: 20 N}}", mass="1 kg", more=PLACE)
    run = run_task(file, log=tmp_path / "cup.mcap")
    assert run.verdict.verdict == "passed", run.verdict.text
    line = "'block' held by suction (20 N), no friction grasp"
    assert run.verdict.holding == (line,)
    assert f"\n{line}\n" in render_verdict(run.verdict, "")
    bare = replace(run.verdict, steps=(), expectations=())
    assert f'<property name="holding" value="{line}" />' in render_junit(bare, [], []).decode()
    assert json.loads(render_run(RunReport(run.verdict, Timing())))["holding"] == [line]
    recording = open_recording(tmp_path / "cup.mcap")
    assert recording.metadata["run"]["holding"] == "suction"
    kinds = [event.kind for event in recording.events if "attach" in event.kind or "detach" in event.kind]
    assert kinds == ["attached", "detached"]


@pytest.mark.parametrize(
    ("engine", "holding"), [("pybullet", "{suction: {force: 20 N}}"), ("mujoco", "{weld: {force: 20 N}}")]
)
def test_a_block_that_is_too_heavy_fails_its_lift(tmp_path: Path, engine: str, holding: str) -> None:
    run = run_task(written(tmp_path, CUP, engine=engine, holding=holding, mass="2.25 kg"), log=tmp_path / "cup.mcap")
    assert [step.outcome for step in run.verdict.steps] == ["done", "failed"]
    kind = "suction" if "suction" in holding else "weld"
    assert f"the hand does not carry 'block': the {kind} lost 'block' at" in run.verdict.text
    recording = open_recording(tmp_path / "cup.mcap")
    assert [event.step for event in recording.events if event.kind == "attachment_broken"] == ["lift_1"]


def test_conditions_on_fingers_are_refused(tmp_path: Path) -> None:
    more = "expect:\n  - grasped: {object: block}\n"
    with pytest.raises(InvalidInput) as refused:
        run_task(
            written(tmp_path, CUP, engine="pybullet", holding="weld", mass="1 kg", more=more), log=tmp_path / "cup.mcap"
        )
    assert "`grasped` needs two fingers that press: 'gantry' holds by weld" in str(refused.value)


@pytest.mark.parametrize(("engine", "pitch"), [("pybullet", 75), ("mujoco", 90)])
def test_a_cup_comes_at_the_pitch_that_is_asked_for(tmp_path: Path, engine: str, pitch: int) -> None:
    """The gantry cannot tilt its cup: it can come at 90 deg only, and says so of any other pitch."""
    file = written(tmp_path, CUP, engine=engine, holding="{suction: {force: 20 N}}", mass="1 kg")
    file.write_text(file.read_text().replace("{from: top}", f"{{pitch: {pitch} deg}}"))
    if pitch == 90:
        assert run_task(file, log=tmp_path / "cup.mcap").verdict.verdict == "passed"
    else:
        with pytest.raises(NotPlannable):
            plan_task(load_task(file))


def test_a_pitch_far_from_all_faces_is_refused_by_name(tmp_path: Path) -> None:
    file = written(tmp_path, CUP, engine="pybullet", holding="{suction: {force: 20 N}}", mass="1 kg")
    file.write_text(file.read_text().replace("{from: top}", "{pitch: 45 deg}"))
    with pytest.raises(NotPlannable, match=r"no face of 'block' is within 30 deg of an approach at 45 deg") as refused:
        plan_task(load_task(file))
    assert "approach: {pitch: ...}" in str(refused.value.hint)
