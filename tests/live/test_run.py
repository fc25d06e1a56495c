"""Steps of a task in a live session: judged as by `run`, whatever happens after them; a client can preempt them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from manipcli import pipeline
from manipcli.live.command import END, PUBLISH, Command
from manipcli.logs.judge_log import judge_log
from manipcli.record.json_message import definition, from_json
from manipcli.run.execute import build_manager
from manipcli.task.part import LIVE_RUN
from tests.live.sessions import HOME, SMALL, simulated, trajectory

MOVES = (
    SMALL.replace("steps: [wait: 0.1 s]", "steps: [move: {to: {joint_1: 20 deg}}, move: {to: home}]")
    + "expect: [tracking: {group: arm, within: 5 deg}, duration: {below: 5 s}, at_pose: {pose: home, within: 3 deg}]\n"
)


@pytest.fixture(scope="module")
def moves(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "small.yaml"
    path.write_text(MOVES)
    return path


def to(positions: tuple[float, ...]) -> Command:
    """A trajectory of the arm that takes 1 s."""
    found = trajectory([f"joint_{k}" for k in range(1, 8)], positions, 1.0)
    message = from_json(definition("trajectory_msgs/JointTrajectory"), found)
    return Command(PUBLISH, "/arm_controller/joint_trajectory", json=json.dumps(message))


def test_what_clients_do_after_the_steps_is_not_judged(moves: Path, tmp_path: Path) -> None:
    """The verdict is that of the same task without a session, to the last bit of each margin."""
    alone = pipeline.run_task(moves, log=tmp_path / "alone.mcap").verdict
    after = round(1000 * alone.simulated_time) + 50
    log = tmp_path / "live.mcap"
    away = tuple(value + 0.2 for value in HOME)
    simulated(moves, {after: [to(away)], after + 1500: [Command(END, "")]}, log, LIVE_RUN)

    verdict = judge_log(log)
    assert (verdict.verdict, verdict.steps, verdict.expectations) == ("passed", alone.steps, alone.expectations)
    assert verdict.simulated_time == pytest.approx(alone.simulated_time + 1.55, abs=0.01)
    assert pipeline.verify_log(log).identical


def test_a_client_preempts_a_step_which_fails(moves: Path, tmp_path: Path) -> None:
    log = tmp_path / "live.mcap"
    simulated(moves, {100: [to(HOME)], 1500: [Command(END, "")]}, log, LIVE_RUN)
    verdict = judge_log(log)
    assert [step.outcome for step in verdict.steps] == ["failed", "not_run"]
    assert verdict.steps[0].ended == pytest.approx(0.1, abs=0.002)
    assert "preempted by a new goal" in verdict.text


def test_a_session_that_ends_in_a_step_interrupts_it(moves: Path, tmp_path: Path) -> None:
    log = tmp_path / "live.mcap"
    simulated(moves, {100: [Command(END, "")]}, log, LIVE_RUN)
    verdict = judge_log(log)
    assert verdict.verdict == "failed"
    assert [step.outcome for step in verdict.steps] == ["interrupted", "not_run"]
    assert pipeline.verify_log(log).identical


def test_a_robot_alone_is_served_and_there_is_nothing_to_judge(tmp_path: Path) -> None:
    root = Path(__file__).parents[2]
    log = tmp_path / "session.mcap"
    with pipeline.bare_task(root / "robots/arm7_hand3/robot.yaml", root / "controllers/arm7_hand3.yaml") as path:
        simulated(path, {50: [Command(END, "")]}, log)
        task = pipeline.load_task(path)
    assert not task.scene.movable
    assert build_manager(replace(task, part=LIVE_RUN)).controllers
    verdict = judge_log(log)
    assert (verdict.verdict, verdict.text.partition(":")[0]) == ("passed", "nothing to judge")
    assert pipeline.verify_log(log).identical
