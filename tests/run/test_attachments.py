"""A suction cup without a hand picks and places; what it cannot hold falls, and every result names it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task
from manipcli.record.read.reading import open_recording
from manipcli.report.json import render_run
from manipcli.report.junit import render_junit
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.text import render_verdict

MASS = '<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
LIMIT = '<limit lower="-0.5" upper="0.5" effort="500" velocity="1"/>'
LINKS = "".join(f'<link name="{name}">{MASS}</link>' for name in ("rail", "bridge", "trolley", "quill"))
GANTRY = f"""<robot name="gantry">{LINKS}
  <link name="cup">{MASS}<collision><origin xyz="0 0 -0.03"/>
    <geometry><cylinder radius="0.012" length="0.06"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="rail"/><child link="bridge"/><axis xyz="1 0 0"/>{LIMIT}</joint>
  <joint name="y" type="prismatic"><parent link="bridge"/><child link="trolley"/><axis xyz="0 1 0"/>{LIMIT}</joint>
  <joint name="z" type="prismatic"><parent link="trolley"/><child link="quill"/><axis xyz="0 0 -1"/>{LIMIT}</joint>
  <joint name="yaw" type="revolute"><parent link="quill"/><child link="cup"/><origin rpy="3.14159265358979 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1" effort="50" velocity="3"/></joint>
</robot>"""
ROBOT = """robot: gantry
description: gantry.urdf
mount: {xyz: [0, 0, 0.5]}
groups: {arm: {chain: {base: rail, tip: cup}}}
poses: {home: {arm: [0, 0, 0.1, 0]}}
tool: {link: cup, holding: HOLDING}
default_acceleration: 4
"""
CONTROLLERS = """controllers:
  arm: {type: joint_trajectory, joints: [x, y, z, yaw], command_interface: position}
"""
TASK = """task: cup
robot: robot.yaml
controllers: controllers.yaml
start: home
simulation: {engine: ENGINE}
scene:
  table: {box: {size: [1.2, 1.2, 0.1]}, pose: {xyz: [0, 0, 0.05]}, fixed: true}
  block: {box: {size: [0.04, 0.04, 0.04]}, at: [0.1, 0.1], rests_on: table, mass: MASS}
steps:
  - pick: {object: block}
  - lift: {object: block, by: 6 cm}
"""
PLACE = """  - place: {object: block, at: [-0.1, 0], onto: table, clearance: 3 cm, retreat: 8 cm}
expect:
  - near: {object: block, to: [-0.1, 0, 0.12], within: 3 mm}
"""


def written(folder: Path, engine: str, holding: str, mass: str, more: str = "") -> Path:
    (folder / "gantry.urdf").write_text(GANTRY)
    (folder / "robot.yaml").write_text(ROBOT.replace("HOLDING", holding))
    (folder / "controllers.yaml").write_text(CONTROLLERS)
    file = folder / "task.yaml"
    file.write_text(TASK.replace("ENGINE", engine).replace("MASS", mass) + more)
    return file


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_a_cup_picks_and_places_and_every_result_names_it(tmp_path: Path, engine: str) -> None:
    file = written(tmp_path, engine, "{suction: {force: 20 N}}", "1 kg", PLACE)
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
    run = run_task(written(tmp_path, engine, holding, "2.25 kg"), log=tmp_path / "cup.mcap")
    assert [step.outcome for step in run.verdict.steps] == ["done", "failed"]
    kind = "suction" if "suction" in holding else "weld"
    assert f"the hand does not carry 'block': the {kind} lost 'block' at" in run.verdict.text
    recording = open_recording(tmp_path / "cup.mcap")
    assert [event.step for event in recording.events if event.kind == "attachment_broken"] == ["lift_1"]


def test_conditions_on_fingers_are_refused(tmp_path: Path) -> None:
    more = "expect:\n  - grasped: {object: block}\n"
    with pytest.raises(InvalidInput) as refused:
        run_task(written(tmp_path, "pybullet", "weld", "1 kg", more), log=tmp_path / "cup.mcap")
    assert "`grasped` needs two fingers that press: 'gantry' holds by weld" in str(refused.value)
