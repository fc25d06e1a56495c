"""Whole runs of small tasks, with physics: bad starts, aborted goals, timeouts, ends before the end."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.core.errors import SimulationFailed
from manipcli.judge.verdict import Verdict
from manipcli.plan.motion import Motion
from manipcli.record.read.reading import read_recording
from manipcli.run import observer, step_attempt
from manipcli.run import step_loop as steps_run

ROOT = Path(__file__).parents[2]
TABLE = "table: {box: {size: [0.4, 0.4, 0.2]}, pose: {xyz: [0.7, 0, 0.1]}, fixed: true}"
HEAD = f"""\
task: small
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
start: home
simulation: {{settle: 0.3 s}}
"""
Run = Callable[..., Verdict]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Runs a task given as text; the log is `small.mcap` in the test's folder."""

    def run_text(text: str, *overrides: str, progress: observer.Progress = observer.SILENT) -> Verdict:
        file = tmp_path / "small.yaml"
        file.write_text(HEAD + text)
        log = tmp_path / "small.mcap"
        report = pipeline.run_task(file, overrides=overrides, log=log, force=True, progress=progress)
        assert pipeline.judge_log(log) == report.verdict
        return report.verdict

    return run_text


def scene(*bodies: str, steps: str = "wait: 0.1 s") -> str:
    return "scene:\n" + "".join(f"  {body}\n" for body in bodies) + f"steps:\n  - {steps}\n"


def test_a_task_without_expectations_passes_and_says_so(run: Run) -> None:
    verdict = run(scene(TABLE))
    assert verdict.verdict == "passed"
    assert "no expectations" in verdict.text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("ball", "ball: {sphere: {radius: 2 cm}, mass: 10 g, pose: {xyz: [0.7, 0, 0.3]}}"),
        ("pole", "pole: {box: {size: [2 cm, 2 cm, 20 cm]}, mass: 1, pose: {xyz: [0.7, 0, 0.303], rpy: [0, 9 deg, 0]}}"),
    ],
    ids=["in the air", "off balance"],
)
def test_a_body_that_cannot_stay_where_it_starts_is_named(run: Run, name: str, body: str) -> None:
    verdict = run(scene(TABLE, body))
    assert verdict.verdict == "failed"
    assert f"'{name}'" in verdict.text
    assert [step.outcome for step in verdict.steps] == ["not_run"]


@pytest.mark.slow
def test_what_stands_stays(run: Run, tmp_path: Path) -> None:
    """Over half a second nothing creeps: below 0.1 mm and 0.1 deg."""
    verdict = run(
        scene(
            TABLE,
            "cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 g, rests_on: table, at: [0.7, 0.05]}",
            "ball: {sphere: {radius: 14 mm}, mass: 10 g, inside: cup, rolling_friction: 1e-4}",
            "brick: {box: {size: [4 cm, 4 cm, 10 cm]}, mass: 80 g, rests_on: table, at: [0.6, -0.1], yaw: 20 deg}",
            steps="wait: 0.5 s",
        )
    )
    assert verdict.verdict == "passed"
    states = read_recording(tmp_path / "small.mcap").states
    assert abs(states.body_position - states.body_position[0]).max() < 1e-4


def test_a_goal_that_leaves_its_tolerance_ends_the_run_with_joint_value_limit_and_time(run: Run) -> None:
    steps = "move: {to: {joint_1: 0.5}}\n  - wait: 1 s"
    name = "controllers.arm_controller.constraints.joints.joint_1.trajectory"
    verdict = run(scene(TABLE, steps=steps), f"{name}=1e-4")
    moved, waited = verdict.steps
    assert (verdict.verdict, moved.outcome, waited.outcome) == ("failed", "failed", "not_run")
    for word in ("'joint_1'", "path tolerance", "limit 0.0001 rad", "at t = "):
        assert word in moved.text
    assert moved.ended is not None
    assert moved.ended < 0.5
    assert verdict.simulated_time == pytest.approx(moved.ended + steps_run.AFTERMATH, abs=0.01)


@pytest.mark.slow
def test_a_move_of_one_joint_leaves_the_others_where_they_are(run: Run, tmp_path: Path) -> None:
    verdict = run(scene(TABLE, steps="move: {to: {joint_3: 0.3}}\n  - move: {to: {joint_1: -0.4}}"))
    assert verdict.verdict == "passed"
    states = read_recording(tmp_path / "small.mcap").states
    home = [0.0, 0.1, 0.0, -1.6, 0.0, -0.1, 0.0]
    assert states.position[-1][:7] == pytest.approx([-0.4, 0.1, 0.3, *home[3:]], abs=0.01)


@pytest.mark.slow
def test_a_hand_that_grips_air_fails_its_step(run: Run) -> None:
    verdict = run(scene(TABLE, steps="grasp: {posture: wrap}"))
    assert verdict.steps[0].outcome == "failed"
    assert "closed on nothing" in verdict.steps[0].text


def test_a_timeout_ends_the_step_at_its_time(run: Run) -> None:
    verdict = run(scene(TABLE, steps="move: {to: zero}\n    timeout: 200 ms"))
    step = verdict.steps[0]
    assert (verdict.verdict, step.outcome) == ("failed", "timeout")
    assert step.ended == pytest.approx(0.2)


WAITING = (
    TABLE,
    "ball: {sphere: {radius: 2 cm}, mass: 10 g, rests_on: table, at: [0.7, 0]}",
)
NEAR = "wait: 0.1 s\n    until: {near: {object: ball, to: [0.7, 0, 0.22], within: 1 cm}}"


@pytest.mark.slow
def test_until_that_holds_ends_the_step_and_one_that_does_not_fails_it(run: Run) -> None:
    held = run(scene(*WAITING, steps=NEAR))
    assert held.steps[0].outcome == "done"
    assert held.steps[0].ended == pytest.approx(0.1, abs=0.011)

    missed = run(scene(*WAITING, steps=NEAR.replace("0.22", "0.32") + "\n    timeout: 0.5 s"))
    assert missed.steps[0].outcome == "timeout"
    assert missed.steps[0].ended == pytest.approx(0.5)
    assert "until" in missed.steps[0].text


@pytest.mark.slow
def test_the_time_for_an_until_ends_with_it(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """What follows in the step (a cup tilted back) may take longer than was left to wait."""
    plan_task = pipeline.plan_task

    def with_a_sequel(task: pipeline.Task, **_: object) -> pipeline.Plan:
        plan = plan_task(task)
        sequel = Motion("sequel", trajectory=None, grip=None, duration=0.5)
        (step,) = plan.steps
        longer = replace(step, plan=replace(step.plan, motions=(*step.plan.motions, sequel)))
        return replace(plan, steps=(longer,), branches={(): (longer,)})

    monkeypatch.setattr(pipeline, "plan_task", with_a_sequel)
    monkeypatch.setattr(step_attempt, "DEFAULT_UNTIL_TIME", 0.2)
    step = run(scene(*WAITING, steps=NEAR)).steps[0]
    assert step.outcome == "done"
    assert step.ended == pytest.approx(0.6, abs=0.011)


class Stopping:
    """Raises when the simulated time comes."""

    def __init__(self, at: float, error: BaseException) -> None:
        self._at, self._error = at, error
        self.heard: list[str] = []

    def activity(self, what: str) -> None:
        self.heard.append(what)

    def warned(self, findings: object) -> None: ...

    def step_started(self, step: object, index: int, total: int) -> None: ...

    def message(self, text: str, *, detail: bool) -> None: ...

    def tick(self, simulated_time: float, wall: float) -> None:
        if simulated_time >= self._at:
            raise self._error

    def step_ended(self, outcome: object) -> None: ...


def test_each_step_that_is_planned_and_each_span_that_is_judged_is_a_sign_of_life(run: Run) -> None:
    progress = Stopping(9.0, KeyboardInterrupt())
    run(scene(TABLE, steps="wait: 0.9 s\n  - wait: 0.9 s"), "simulation.engine=kinematic", progress=progress)
    planning = ["planning step 1 of 2, 'wait_1'", "planning step 2 of 2, 'wait_2'"]
    assert progress.heard[:2] == planning
    assert set(progress.heard[2:]) == {"judging"}
    assert len(progress.heard[2:]) >= 4  # a span each half second


def test_an_interrupted_run_leaves_a_whole_log_that_says_so(run: Run, tmp_path: Path) -> None:
    verdict = run(scene(TABLE, steps="wait: 5 s"), progress=Stopping(0.4, KeyboardInterrupt()))
    assert verdict.verdict == "error"
    assert [finding.code for finding in verdict.errors] == ["RUN101"]
    assert verdict.steps[0].outcome == "interrupted"
    recording = read_recording(tmp_path / "small.mcap")
    assert recording.lost is None
    assert recording.states.time[-1] == pytest.approx(0.4)
    assert not list(tmp_path.glob("*.partial"))


def test_physics_that_ends_a_run_is_a_failed_step_with_its_cause(run: Run) -> None:
    verdict = run(scene(TABLE, steps="wait: 5 s"), progress=Stopping(0.2, SimulationFailed("it flew", time=0.2)))
    assert (verdict.verdict, verdict.steps[0].outcome) == ("failed", "failed")
    assert verdict.steps[0].text == "it flew at t = 0.200 s"


@pytest.mark.slow
def test_physics_that_ends_after_the_last_step_is_no_pass(run: Run) -> None:
    verdict = run(scene(TABLE, steps="wait: 0.1 s"), progress=Stopping(0.3, SimulationFailed("it flew", time=0.3)))
    assert verdict.steps[0].outcome == "done"
    assert (verdict.verdict, verdict.text) == ("failed", "it flew at t = 0.300 s")


def test_a_fault_keeps_what_was_recorded(run: Run, tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        run(scene(TABLE, steps="wait: 5 s"), progress=Stopping(0.7, ZeroDivisionError()))
    assert not (tmp_path / "small.mcap").exists()
    partial = read_recording(tmp_path / "small.mcap.partial")
    assert partial.states.time[-1] == pytest.approx(0.7, abs=0.002)
    assert pipeline.judge_log(tmp_path / "small.mcap.partial").verdict == "error"


def test_with_the_ideal_engine_the_plan_comes_true(run: Run, tmp_path: Path) -> None:
    verdict = run(scene(TABLE, steps="move: {to: zero}"), "simulation.engine=kinematic")
    assert verdict.verdict == "passed"
    recording = read_recording(tmp_path / "small.mcap")
    assert abs(recording.states.position[-1][:7]).max() < 1e-9
    assert verdict.steps[0].ended == pytest.approx(verdict.steps[0].planned_duration, abs=0.005)


def test_a_touch_of_a_moment_between_objects_is_not_missed(run: Run, tmp_path: Path) -> None:
    """A ball that falls 8 cm bounces at t = sqrt(2 h / g) = 0.128 s, within a few ticks."""
    ball = "ball: {sphere: {radius: 2 cm}, mass: 100 g, restitution: 1.0, pose: {xyz: [0.7, 0, 0.3]}}"
    table = TABLE.replace("fixed: true", "fixed: true, restitution: 1.0")
    text = scene(table, ball, steps="wait: 0.2 s") + "expect:\n  - no_collision: {pairs: [[ball, table]]}\n"
    verdict = run(text, "simulation.settle=0 s")
    assert verdict.verdict == "failed"
    (outcome,) = verdict.expectations
    assert outcome.at == pytest.approx(math.sqrt(2 * 0.08 / 9.81), abs=0.003)
    states = read_recording(tmp_path / "small.mcap").states
    height = states.body_position[states.time < 0.25, 0, 2]
    assert abs(float(states.time[np.argmin(height)]) - outcome.at) < 0.003
    assert height[-1] > 0.25  # it was a bounce
