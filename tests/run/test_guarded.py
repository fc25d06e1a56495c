"""Guarded moves: what they lack is told, and where they stop the task goes on from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.model.kinematics import Kinematics
from manipcli.pipeline import run_task
from manipcli.preflight.check_files import check_files
from manipcli.record.read.reading import open_recording
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
ARM = f"robot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
PANDA = f"robot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
TABLE = "scene:\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"


def task_file(folder: Path, text: str) -> Path:
    file = folder / "task.yaml"
    file.write_text("task: t\n" + text)
    return file


def told(file: Path) -> list[str]:
    try:
        load_task(file, allow_outside=True)
    except InvalidInput as refused:
        return [f"{f.code} {f.place.line if f.place else 0} {f.message}" for f in refused.findings]
    return []


def test_a_guarded_move_needs_a_condition_and_leave_to_plan_again(tmp_path: Path) -> None:
    until = "    until: {at_pose: {pose: home, within: 10 deg}}\n"
    guarded = "steps:\n  - move: {to: home, guarded: true}\n"
    assert told(task_file(tmp_path, f"{ARM}{guarded}{until}")) == []
    (missing,) = told(task_file(tmp_path, f"{ARM}{guarded}"))
    assert missing == "TASK242 5 steps[0].move.guarded: a guarded move needs an `until`; the step has none"
    (fixed,) = told(task_file(tmp_path, f"{ARM}replan: false\n{guarded}{until}"))
    assert fixed.startswith(
        "TASK242 6 steps[0].move.guarded: a guarded move needs re-planning, since its end is not known in advance"
    )
    touch = guarded + "    until: {contact_force: {of: robot, above: 5 N}}\n"
    (deaf,) = told(task_file(tmp_path, f"{ARM}simulation: {{engine: kinematic}}\n{touch}"))
    assert deaf.startswith("TASK237 7 `until` cannot guard this move: ")
    assert told(task_file(tmp_path, f"{ARM}replan: false\nsteps:\n  - move: {{to: home}}\n{until}")) == []


def test_a_move_that_waits_for_a_force_and_does_not_stop_for_it_is_told(tmp_path: Path) -> None:
    scene, force = ARM + TABLE.replace("0.55", "0.9"), "any: [{contact_force: {of: table, above: 5 N}}]"

    def warned(more: str, until: str = force) -> list[str]:
        step = f"steps:\n  - move: {{to: home, touch: [table]{more}}}\n    until: {{{until}}}\n"
        return [one.code for one in check_files([task_file(tmp_path, scene + step)]) if one.code == "TASK245"]

    assert warned("") == ["TASK245"]
    assert warned(", guarded: true") == []
    assert warned("", "at_pose: {pose: home}") == []
    assert warned("", "not: {no_collision: [robot, table]}") == ["TASK245"]
    for let_go in (
        "contact_force: {of: table, below: 1 N}",
        "not: {contact_force: {of: table, above: 1 N}}",
        "not: {any: [{collision: [robot, table]}]}",
        "no_collision: [robot, table]",
    ):
        assert warned("", let_go) == [], let_go


def test_the_next_step_begins_where_a_guarded_one_stopped(tmp_path: Path) -> None:
    """Within 10 deg of a pose it stops; from there, on to another: no joint makes a step."""
    file = task_file(
        tmp_path,
        f"""{ARM}simulation: {{engine: kinematic}}
steps:
  - move: {{to: {{joint_1: 1.0}}}}
  - move: {{to: home, guarded: true}}
    until: {{at_pose: {{pose: home, within: 10 deg}}}}
  - move: {{to: {{joint_2: 0.2}}}}
""",
    )
    report = run_task(file, log=tmp_path / "log.mcap", allow_outside=True)
    assert report.verdict.verdict == "passed"
    stopped, last = report.verdict.steps[1:]
    assert stopped.text.endswith("`until` held")
    recording = open_recording(tmp_path / "log.mcap")
    states = recording.states
    at = {name: k for k, name in enumerate(load_task(file, allow_outside=True).robot.joint_names)}
    turned = states.position[:, at["joint_1"]]
    end = turned[np.searchsorted(states.time, stopped.ended)]
    assert 0.0 < end < np.radians(10.0)
    assert turned[-1] == pytest.approx(end)
    assert states.position[-1, at["joint_2"]] == pytest.approx(0.2)
    assert np.abs(np.diff(states.position, axis=0)).max() < 0.01
    assert last.outcome == "done"


def test_what_stopped_a_guarded_move_and_does_not_hold_at_rest_is_told(tmp_path: Path) -> None:
    """It stops because it is fast, and then is not; a hand that knocks on something and bounces off is told so."""
    file = task_file(
        tmp_path,
        f"""{ARM}simulation: {{engine: kinematic}}
steps:
  - move: {{to: {{joint_1: 1.0}}, guarded: true}}
    until: {{not: {{tool_speed: {{below: 10 cm/s}}}}}}
""",
    )
    (step,) = run_task(file, log=tmp_path / "log.mcap", allow_outside=True).verdict.steps
    assert step.outcome == "done"
    assert "its end: `until` held; at rest it fails by 100 mm/s: " in step.text


def test_no_way_out_is_proposed_that_a_guarded_move_forbids(tmp_path: Path) -> None:
    """It stops soon on its way up, from where the next one ends below the floor; it is refused with `replan: false`."""
    file = task_file(
        tmp_path,
        f"""{PANDA}simulation: {{engine: kinematic}}
steps:
  - move: {{pose: {{xyz: [0.5, 0, 0.25], rpy: [180 deg, 0, 0]}}}}
  - move: {{pose: {{xyz: [0, 0, -20 cm]}}, frame: tool, path: linear, guarded: true}}
    until: {{not: {{tool_speed: {{below: 5 cm/s}}}}}}
  - move: {{pose: {{xyz: [0, 0, 30 cm]}}, frame: tool, path: linear}}
""",
    )
    last = run_task(file, log=tmp_path / "log.mcap", allow_outside=True).verdict.steps[-1]
    assert last.text.startswith("re-planning from the measured state failed")
    assert "replan: false" not in last.text


@pytest.mark.slow
def test_a_hand_presses_as_hard_as_asked_and_goes_on_from_there(tmp_path: Path) -> None:
    """It comes down on a table, through which the plan goes on for 5 cm, stays, and rises from where it is."""
    file = task_file(
        tmp_path,
        f"""{PANDA}{TABLE}steps:
  - move: {{pose: {{xyz: [0.5, 0, 0.25], rpy: [180 deg, 0, 0]}}}}
  - move:
      {{pose: {{xyz: [0, 0, 7 cm]}}, frame: tool, path: linear, velocity_scaling: 0.02, touch: [table], guarded: true}}
    until: {{contact_force: {{pair: [robot, table], above: 20 N, mean_over: 50 ms}}}}
  - wait: 0.3 s
  - move: {{pose: {{xyz: [0, 0, -5 cm]}}, frame: tool, path: linear, touch: [table]}}
""",
    )
    report = run_task(file, log=tmp_path / "log.mcap", allow_outside=True)
    assert report.verdict.verdict == "passed"
    _, press, stay, _ = report.verdict.steps
    recording = open_recording(tmp_path / "log.mcap")
    states, times = recording.states, recording.states.time
    forces = np.array(
        [sum(one.force for one in snapshot.contacts if "table" in one) for snapshot in recording.contacts]
    )
    holds = np.searchsorted([snapshot.time for snapshot in recording.contacts], times, side="right") - 1
    pressed = forces[holds]
    before, during = (times > press.ended - 0.1) & (times < press.ended), (times > press.ended) & (times < stay.ended)
    assert pressed[before].mean() == pytest.approx(20.0, abs=3.0)
    assert 10.0 < pressed[during].mean() < 25.0
    assert pressed[-100:].max() == 0.0
    kinematics = Kinematics(load_task(file, allow_outside=True).robot)
    tool = np.array([kinematics.forward(q, "panda_hand").p for q in states.position[:: len(times) // 400]])
    # From where it was commanded to be, as deep in the table as 20 N push it away from there.
    assert 0.035 < tool[-1, 2] - tool[:, 2].min() < 0.05


@pytest.mark.slow
def test_what_a_guarded_move_carries_beyond_its_first_touch_is_still_held(tmp_path: Path) -> None:
    """The block pushes a toy, which is planned to stop it; the condition holds only where all rests, at the end."""
    file = task_file(
        tmp_path,
        f"""{PANDA}{TABLE}  block: {{box: {{size: [4 cm, 4 cm, 6 cm]}}, mass: 100 g, rests_on: table, at: [0.5, -0.2]}}
  toy: {{box: {{size: [12 cm, 12 cm, 7 cm]}}, mass: 30 g, friction: 0.2, rests_on: table, at: [0.5, -0.08]}}
steps:
  - pick: {{object: block, approach: {{from: top}}}}
  - lift: {{object: block, by: 4 cm}}
  - move:
      pose: {{xyz: [0.5, 0, 0.27], rpy: [180 deg, 0, 0]}}
      path: linear
      velocity_scaling: 0.1
      touch: [toy]
      guarded: true
    until: {{all: [{{moved: {{object: toy, by: 10 cm}}}}, {{at_rest: {{object: toy, below: 0.02 mm/s}}}}]}}
""",
    )
    report = run_task(file, log=tmp_path / "log.mcap", allow_outside=True)
    assert report.verdict.verdict == "passed", report.verdict.text
