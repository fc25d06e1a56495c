"""What a task does while it runs, on the ideal engine: tries again, goes on, stops where a watch is broken."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.core.errors import InvalidInput
from manipcli.judge.verdict import Verdict
from manipcli.record.read.reading import read_recording
from manipcli.record.recording import TaskEvent
from manipcli.report import json as json_report
from manipcli.run.observer import SILENT, Progress
from manipcli.simulate.executor import REST

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: small
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
start: up
params: {{near: 0.05, wide: 2 * $near, goal: up}}
simulation: {{engine: kinematic, settle: 0, control_period: 2 ms, step: 2 ms}}
"""
PERIOD = 0.002
ACCELERATION = 30.0
"""Of the pitch joint [rad/s^2]; its jerk is unlimited."""
AWAY = "  - move: {to: {pitch: 0.3}}\n"
UP = "    until: {at_pose: {pose: up, within: $wide}}\n    timeout: 0.4 s\n"
Run = Callable[..., Verdict]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Runs a task given as text; the log is `small.mcap` in the test's folder, and judged again it says the same."""

    def run_text(text: str, progress: Progress = SILENT) -> Verdict:
        file, log = tmp_path / "small.yaml", tmp_path / "small.mcap"
        file.write_text(HEAD + text)
        report = pipeline.run_task(file, log=log, force=True, progress=progress)
        assert pipeline.judge_log(log) == report.verdict
        return report.verdict

    return run_text


def events(folder: Path, *kinds: str) -> list[TaskEvent]:
    return [one for one in read_recording(folder / "small.mcap").events if one.kind in kinds]


def test_a_step_that_fails_ends_the_run_where_nothing_else_is_said(run: Run) -> None:
    verdict = run(f"steps:\n{AWAY}{UP}  - wait: 0.1 s\n")
    assert verdict.verdict == "failed"
    assert [step.outcome for step in verdict.steps] == ["timeout", "not_run"]
    assert [len(step.attempts) for step in verdict.steps] == [1, 0]


def test_a_condition_that_is_waited_for_in_vain_is_told_with_what_it_lacks(run: Run) -> None:
    """0.3 rad away, 0.1 rad allowed: 0.2 rad, 11.5 deg. Also in a combination, and in a wait."""
    at_end = "`until` %s; at the end it fails by 11.5 deg: at_pose: joint 'pitch' is 17.2 deg from"
    assert at_end % "did not hold by t = 0.400 s" in run(f"steps:\n{AWAY}{UP}").steps[0].text
    both = UP.replace("{at_pose", "{all: [{duration: {below: 10 s}}, {at_pose").replace("$wide}}", "$wide}}]}")
    assert at_end % "did not hold by t = 0.400 s" in run(f"steps:\n{AWAY}{both}").steps[0].text
    assert at_end % "held" in run(f"steps:\n{AWAY}  - wait: 0.1 s\n{UP}").steps[1].text


def test_a_condition_that_holds_at_the_deadline_has_come_to_hold(run: Run) -> None:
    """The time is over between two looks, 5 ticks after the last."""
    until = "    until: {not: {duration: {below: 105 ms}}}\n    timeout: 110 ms\n"
    assert run(f"steps:\n  - wait: 0.05 s\n{until}").steps[0].outcome == "done"


def test_a_retry_has_other_parameters_also_in_those_made_of_them(run: Run, tmp_path: Path) -> None:
    """`wide` is twice `near`: 0.1 does not hold 0.3 rad away, 0.4 does."""
    steps = f"{AWAY}{UP}    on_fail: {{retry: 3, with: {{near: 0.2}}}}\n  - wait: 0.1 s\n"
    verdict = run(f"steps:\n{steps}")
    assert verdict.verdict == "passed"
    step = verdict.steps[0]
    assert [one.outcome for one in step.attempts] == ["timeout", "done"]
    first, second = step.attempts
    assert (first.ended, step.started, step.ended) == (pytest.approx(0.4), 0.0, second.ended)
    assert second.started == pytest.approx(0.4 + REST)
    started = events(tmp_path, "step_started")
    assert [one.text for one in started] == ["attempt 1 of 4", "attempt 2 of 4, with near = 0.2", ""]
    assert [one.text for one in events(tmp_path, "replanned")] == ["joint 'pitch' is at 0.3 rad instead of 0 rad"]
    shown = json.loads(json_report.render_verdict(verdict, "small.mcap"))["steps"][0]
    assert [one["outcome"] for one in shown["attempts"]] == ["timeout", "done"]
    assert len(shown["replanned"]) == 1


def test_a_retry_that_never_helps_fails_with_its_last_attempt(run: Run) -> None:
    verdict = run(f"steps:\n{AWAY}{UP}    on_fail: {{retry: 2}}\n")
    assert verdict.verdict == "failed"
    assert [one.outcome for one in verdict.steps[0].attempts] == ["timeout"] * 3
    assert "`until` did not hold by t = 2.200 s" in verdict.text


@pytest.mark.parametrize("on_fail", ["continue", "{retry: 1, then: continue}"])
def test_a_failure_that_is_tolerated_does_not_count_and_the_next_step_begins_where_the_robot_is(
    run: Run, tmp_path: Path, on_fail: str
) -> None:
    """Stopped on its way: the way home is planned from there, without a jump."""
    late = "  - move: {to: {pitch: 1.0}}\n    timeout: 0.1 s\n"
    verdict = run(f"steps:\n{late}    on_fail: {on_fail}\n  - move: {{to: up}}\n")
    assert verdict.verdict == "passed"
    assert "1 of 2 steps done, failure of move_1 tolerated" in verdict.text
    assert [(step.outcome, step.tolerated) for step in verdict.steps] == [("timeout", True), ("done", False)]
    (replanned,) = verdict.steps[1].replanned
    assert replanned.startswith("joint 'pitch' is at ")
    assert replanned.endswith("instead of 1 rad")
    states = read_recording(tmp_path / "small.mcap").states
    assert np.abs(np.diff(states.velocity[:, 0])).max() < 1.001 * ACCELERATION * PERIOD
    assert abs(states.position[-1, 0]) < 1e-9


def test_what_follows_a_tolerated_failure_where_nothing_differs_says_why_it_is_planned_again(run: Run) -> None:
    never = "  - wait: 0.1 s\n    until: {not: {at_pose: {pose: up}}}\n    timeout: 0.2 s\n    on_fail: %s\n"
    verdict = run(f"steps:\n{never % 'continue'}  - wait: 0.1 s\n  - wait: 0.1 s\n")
    assert [step.replanned for step in verdict.steps] == [(), ("the previous step failed",), ()]
    (step,) = run(f"steps:\n{never % '{retry: 1}'}").steps
    assert step.replanned == ("retry",)


WATCH = "watch:\n  - always: {at_pose: {pose: up, within: 0.2}}\n"


def test_a_watch_stops_the_robot_within_its_limits_and_names_moment_and_excess(run: Run, tmp_path: Path) -> None:
    """s = a t^2 / 2 passes 0.2 rad at t = sqrt(2 0.2 / a); it is seen 10 ticks later at most, and braked with a."""
    verdict = run(f"steps:\n  - wait: 0.1 s\n  - move: {{to: {{pitch: 1.0}}}}\n  - wait: 1 s\n{WATCH}")
    assert verdict.verdict == "failed"
    assert [step.outcome for step in verdict.steps] == ["done", "failed", "not_run"]
    states = read_recording(tmp_path / "small.mcap").states
    (watched,) = verdict.expectations
    assert (watched.name, watched.outcome) == ("watch_at_pose", "failed")
    (told,) = events(tmp_path, "watch_broken")
    assert (told.step, told.place) == ("move_1", "small.yaml:12:5")
    crossed = 0.1 + (2 * 0.2 / ACCELERATION) ** 0.5
    broken = float(verdict.text.split("'watch_at_pose' is broken at t = ")[1].split(" s by ")[0])
    assert crossed <= broken <= crossed + 2 * PERIOD
    assert broken <= told.time <= broken + 11 * PERIOD
    assert verdict.steps[1].ended == told.time, "braking is no part of the step"
    assert "joint 'pitch'" in verdict.text
    speed = np.abs(states.velocity[:, 0])
    assert np.diff(speed).min() > -1.001 * ACCELERATION * PERIOD
    stopped = told.time + speed.max() / ACCELERATION
    assert speed[states.time > stopped + 2 * PERIOD].max() < 1e-9
    assert states.time[-1] > told.time + REST


def test_a_watch_during_a_step_looks_at_no_other(run: Run) -> None:
    text = f"steps:\n{AWAY}  - move: {{to: up}}\n  - wait: 0.1 s\n{WATCH}    during: %s\n"
    assert run(text % "wait_1").verdict == "passed"
    verdict = run(text % "[move_2, wait_1]")
    assert verdict.steps[1].outcome == "failed"
    assert "during 'move_2' and 'wait_1'" in verdict.expectations[0].text


def test_a_watch_that_is_broken_after_the_last_step_fails_the_run(run: Run, tmp_path: Path) -> None:
    verdict = run("steps:\n  - wait: 0.1 s\nwatch:\n  - always: {duration: {below: 0.3 s}}\n")
    assert verdict.verdict == "failed"
    assert verdict.steps[0].outcome == "done"
    assert [one.step for one in events(tmp_path, "watch_broken")] == [""]
    broken = "broken at t = 0.302 s"
    assert verdict.text.startswith(f"stopped after the last step: 'watch_duration' is {broken}")
    assert verdict.expectations[0].text.endswith(f"; {broken}"), "its worst moment is a later one"
    assert verdict.simulated_time == pytest.approx(0.3 + REST, abs=0.03)


def test_a_watch_that_breaks_in_the_last_ticks_of_its_step_fails_that_step(run: Run, tmp_path: Path) -> None:
    """The step ends between two looks, 5 ticks after the moment."""
    watch = "watch:\n  - always: {duration: {below: 0.1 s}}\n    during: wait_1\n"
    verdict = run(f"steps:\n  - wait: 0.11 s\n  - wait: 0.2 s\n{watch}")
    assert [step.outcome for step in verdict.steps] == ["failed", "not_run"]
    assert "is broken at t = 0.1" in verdict.steps[0].text
    (broken,) = events(tmp_path, "watch_broken")
    assert broken.step == "wait_1"
    assert verdict.steps[0].ended == broken.time == pytest.approx(0.11, abs=1.5 * PERIOD)


def test_a_watch_tells_what_must_never_be_as_that(run: Run) -> None:
    verdict = run(f"steps:\n{AWAY}watch:\n  - never: {{tool_speed: {{below: 1 m/s, link: hand}}}}\n")
    assert "; never below 1 m/s" in verdict.text
    assert "; never below 1 m/s" in verdict.expectations[0].text


def test_a_watch_wins_over_a_retry(run: Run) -> None:
    verdict = run(f"steps:\n{AWAY}    on_fail: {{retry: 5, then: continue}}\n{WATCH}")
    assert verdict.verdict == "failed"
    assert len(verdict.steps[0].attempts) == 1


def test_what_cannot_be_watched_is_not_evaluated(run: Run) -> None:
    verdict = run("steps:\n  - wait: 0.1 s\nwatch:\n  - never: {collision: [robot, floor]}\n")
    assert verdict.verdict == "failed"
    assert "the engine has no physics" in verdict.expectations[0].text


class Stopping:
    """Interrupts when the simulated time comes."""

    def __init__(self, at: float) -> None:
        self.at = at
        self.heard: list[str] = []

    def activity(self, what: str) -> None: ...
    def warned(self, findings: object) -> None: ...
    def step_started(self, step: object, index: int, total: int) -> None: ...
    def step_ended(self, outcome: object) -> None: ...

    def message(self, text: str, *, detail: bool) -> None:
        self.heard += [] if detail else [text]

    def tick(self, simulated_time: float, wall: float) -> None:
        if simulated_time >= self.at:
            raise KeyboardInterrupt


@pytest.mark.parametrize("at", [0.6, 1.0], ids=["while it holds", "in the second attempt"])
def test_an_interruption_between_attempts_ends_the_run_as_everywhere(run: Run, at: float) -> None:
    stopping = Stopping(at)
    verdict = run(f"steps:\n{AWAY}{UP}    on_fail: {{retry: 3}}\n", stopping)
    assert [finding.code for finding in verdict.errors] == ["RUN101"]
    assert verdict.simulated_time == pytest.approx(at, abs=0.11)
    assert len(stopping.heard) == 1
    assert stopping.heard[0].endswith("; retrying")


def test_the_same_attempts_make_the_same_bytes(run: Run, tmp_path: Path) -> None:
    watch = "watch:\n  - always: {duration: {below: 9 s}}\n"
    text = f"steps:\n{AWAY}{UP}    on_fail: {{retry: 1, with: {{near: 0.2}}}}\n{watch}"
    run(text)
    first = (tmp_path / "small.mcap").read_bytes()
    run(text)
    assert (tmp_path / "small.mcap").read_bytes() == first


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("    on_fail: {retry: 1, with: {nea: 1}}\n", "9:32", "unknown parameter 'nea'"),
        ("    on_fail: {retry: 1, with: {near: 5 s}}\n", "8:24", "(in a retry)"),
        ("    on_fail: {retry: 0}\n", "9:22", "must be at least 1, not 0"),
        ("    on_fail: retry\n", "9:14", "'stop'"),
        (
            "    until: {at_pose: {pose: $goal}}\n    on_fail: {retry: 1, with: {goal: dwon}}\n",
            "10:31",
            "'dwon' is not a pose",
        ),
        ("watch:\n  - upright: {object: cup}\n", "10:5", "expected one of never, always"),
        ("watch:\n  - never: {duration: {below: 1 s}}\n    at: end\n", "11:9", "expected no value"),
        ("watch:\n  - never: {duration: {below: 1 s}}\n    during: wait_7\n", "11:13", "no step 'wait_7'"),
        ("replan: maybe\n", "9:9", "expected true or false, or a mapping"),
    ],
)
def test_what_cannot_be_meant_is_told_before_the_run(run: Run, text: str, place: str, words: str) -> None:
    with pytest.raises(InvalidInput) as refusal:
        run(f"steps:\n  - move: {{to: {{pitch: $near}}}}\n{text}")
    told = "\n".join(map(str, refusal.value.findings))
    assert f"small.yaml:{place}" in told, told
    assert words in told, told


@pytest.mark.parametrize(
    "rest",
    [
        "  - move: {to: {pitch: 0.5}}\n",
        "  - wait: 0.1 s\n  - move: {to: {pitch: 0.5}}\n",
        "  - if: {at_pose: {pose: up, within: 3}}\n    then: [{wait: 0.1 s}, {move: {to: {pitch: 0.5}}}]\n"
        "  - move: {to: up}\n",
    ],
)
def test_without_replanning_no_step_jumps_to_its_old_start_after_a_retry_to_another_end(
    run: Run, tmp_path: Path, rest: str
) -> None:
    """The second attempt ends at 0.8 rad instead of 0.2 rad; no joint is faster than a motion can be."""
    first = (
        "  - move: {to: {pitch: 4 * $near}}\n    until: {not: {at_pose: {pose: up, within: 0.5}}}\n    timeout: 1 s\n"
    )
    verdict = run(f"replan: false\nsteps:\n{first}    on_fail: {{retry: 1, with: {{near: 0.2}}}}\n{rest}")
    assert verdict.verdict == "passed"
    recording = read_recording(tmp_path / "small.mcap")
    position = np.concatenate([span.states.position for span in recording.spans])
    assert np.abs(np.diff(position, axis=0)).max() < 0.05
