"""Sequences, choices and steps at the same time while a task runs, mostly on the ideal engine."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.judge.verdict import BlockOutcome, Verdict
from manipcli.logs.report import log_page
from manipcli.record.read.reading import read_recording
from manipcli.record.recording import TaskEvent
from manipcli.replay.cause import Written
from manipcli.report import json as json_report
from manipcli.report.html.render_page import render_page
from manipcli.report.junit import render_junit
from manipcli.report.text import render_verdict
from manipcli.run.step_loop import ASKED

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: small
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
start: up
simulation: {{engine: kinematic, settle: 0, control_period: 2 ms, step: 2 ms}}
"""
PANDA = f"""\
task: small
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
simulation: {{engine: kinematic, settle: 0, control_period: 2 ms, step: 2 ms}}
"""
IF = """\
  - move: {to: {pitch: %s}}
  - if: {at_pose: {pose: up, within: 0.3}}
    then:
      - move: {to: {pitch: 0.5}}
    else:
      - move: {to: {pitch: -0.5}}
  - move: {to: up}
"""
LATE = "      - wait: 0.1 s\n        until: {not: {duration: {below: %s}}}\n        timeout: 0.3 s\n"
Run = Callable[..., Verdict]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Runs steps given as text; the log is `small.mcap` in the test's folder, and judged again it says the same."""

    def run_text(text: str, head: str = HEAD) -> Verdict:
        file, log = tmp_path / "small.yaml", tmp_path / "small.mcap"
        file.write_text(head + "steps:\n" + text)
        report = pipeline.run_task(file, log=log, force=True)
        assert pipeline.judge_log(log) == report.verdict
        return report.verdict

    return run_text


def events(folder: Path, *kinds: str) -> list[TaskEvent]:
    return [one for one in read_recording(folder / "small.mcap").events if one.kind in kinds]


def outcomes(verdict: Verdict) -> dict[str, str]:
    return {step.id: step.outcome for step in verdict.steps}


def by_id(verdict: Verdict) -> dict[str, BlockOutcome]:
    return {block.id: block for block in verdict.blocks}


@pytest.mark.parametrize(("pitch", "taken"), [(0.2, "then"), (0.4, "else")])
def test_the_branch_follows_from_the_recorded_state(run: Run, tmp_path: Path, pitch: float, taken: str) -> None:
    """The log holds the evaluation, the pitch at that tick, and the steps that were not done."""
    verdict = run(IF % pitch)
    assert verdict.verdict == "passed", verdict.text
    assert "3 of 4 steps done, 1 skipped" in verdict.text
    assert {id_ for id_, outcome in outcomes(verdict).items() if outcome == "skipped"} == {
        "if_1/else/move_1" if taken == "then" else "if_1/move_1"
    }
    (branch,) = events(tmp_path, "branch")
    states = read_recording(tmp_path / "small.mcap").states
    (k,) = np.flatnonzero(np.abs(states.time - branch.time) < 1e-4)
    assert branch.outcome == taken == ("then" if abs(states.position[k, 0]) <= 0.3 else "else")
    assert branch.text.startswith("it holds by 5.73 deg" if taken == "then" else "it fails by 5.73 deg")
    assert branch.place == "small.yaml:8:5"
    assert by_id(verdict)["if_1"].taken == taken
    chosen = next(step for step in verdict.steps if step.id.startswith("if_1") and step.outcome == "done")
    assert chosen.started == pytest.approx((verdict.steps[0].ended or 0.0) + ASKED, abs=0.005)
    assert chosen.planned_duration == pytest.approx(chosen.ended - chosen.started, abs=0.01)  # type: ignore[operator]
    assert pipeline.verify_log(tmp_path / "small.mcap").identical


def test_what_is_asked_of_a_skipped_step_is_skipped_and_of_several_steps_counts_those_that_ran(run: Run) -> None:
    expect = (
        "expect:\n  - at_pose: {pose: up, within: 1}\n    at: if_1/else/move_1\n"
        "  - always: {at_pose: {pose: up, within: 0.6}}\n    during: [if_1/move_1, if_1/else/move_1]\n"
        "  - step_done: {step: if_1/else/move_1}\n    at: end\n"
    )
    verdict = run(IF % 0.2 + expect)
    assert [one.outcome for one in verdict.expectations] == ["skipped", "passed", "failed"]
    assert verdict.expectations[0].text == "step 'if_1/else/move_1' was skipped: 'if_1' took then"
    assert verdict.verdict == "failed"
    passed = run(IF % 0.2 + expect[: expect.index("  - step_done")])
    assert passed.verdict == "passed"
    assert passed.text.endswith("1 of 2 expectations met, 1 skipped")


def test_a_condition_that_this_engine_cannot_evaluate_fails_the_run(run: Run) -> None:
    verdict = run("  - if: {no_collision: {pairs: [[robot, robot]]}}\n    then:\n      - wait: 0.1 s\n")
    assert verdict.verdict == "failed"
    assert verdict.text.startswith("if 'if_1' failed: the condition cannot be evaluated: ")


def test_a_sequence_is_done_again_where_the_world_fails_once(run: Run, tmp_path: Path) -> None:
    """The second step has no time to end its way; the first is then done again, too, from where the robot stopped."""
    text = (
        "  - id: twice\n    sequence:\n      - wait: 0.1 s\n      - move: {to: {pitch: 0.9}}\n        timeout: 0.25 s\n"
    )
    verdict = run(f"{text}    on_fail: {{retry: 2}}\n  - move: {{to: up}}\n")
    assert verdict.verdict == "passed", verdict.text
    twice = by_id(verdict)["twice"]
    assert (twice.outcome, twice.attempts) == ("done", 2)
    assert [one.outcome for one in verdict.steps[1].attempts] == ["timeout", "done"]
    assert [len(step.attempts) for step in verdict.steps] == [2, 2, 1]
    started = events(tmp_path, "block_started")
    assert [one.text for one in started] == ["attempt 1 of 3", "attempt 2 of 3"]
    (again,) = events(tmp_path, "step_planned")
    assert again.step == "twice/move_1"
    assert float(again.text) < 0.25
    assert verdict.steps[1].replanned == ()  # it was planned with the others
    assert pipeline.verify_log(tmp_path / "small.mcap").identical


def test_a_sequence_that_may_fail_skips_its_rest(run: Run) -> None:
    """The steps behind it are done; its failure, and what it did not reach, do not count."""
    text = "  - id: group\n    sequence:\n" + LATE % "9 s" + "      - wait: 0.1 s\n    on_fail: continue\n"
    verdict = run(text + "  - move: {to: {pitch: 0.3}}\n")
    assert verdict.verdict == "passed", verdict.text
    assert outcomes(verdict) == {"group/wait_1": "timeout", "group/wait_2": "not_run", "move_1": "done"}
    assert by_id(verdict)["group"].tolerated
    fatal = run((text + "  - move: {to: up}\n").replace("continue", "stop"))
    assert fatal.verdict == "failed"
    assert list(outcomes(fatal).values()) == ["timeout", "not_run", "not_run"]
    assert fatal.text.startswith("step 'group/wait_1' timed out: ")


def test_a_group_ends_at_its_timeout_and_waits_for_its_until(run: Run) -> None:
    timed = run("  - id: group\n    sequence:\n      - wait: 0.2 s\n      - wait: 1 s\n    timeout: 0.5 s\n")
    assert timed.verdict == "failed"
    assert timed.steps[1].ended == pytest.approx(0.5, abs=0.003)
    assert (by_id(timed)["group"].outcome, by_id(timed)["group"].text) == (
        "timeout",
        "its limit of 500 ms was reached",
    )
    group = "  - id: group\n    sequence:\n      - wait: 0.1 s\n    until: {%s: {duration: {below: 0.4 s}}}\n"
    met = run(group % "not" + "  - wait: 0.1 s\n")
    assert met.verdict == "passed"
    assert met.steps[1].started == pytest.approx(0.5, abs=0.021)
    missed = run("  - id: g\n    sequence:\n      - wait: 0.1 s\n    until: {at_pose: {pose: up, within: 0.1}}\n"
                 "    timeout: 0.3 s\n".replace("- wait: 0.1 s", "- move: {to: {pitch: 0.3}}"))  # fmt: skip
    assert outcomes(missed) == {"g/move_1": "done"}
    assert missed.verdict == "failed"
    assert missed.text.startswith("sequence 'g' timed out: `until` did not hold by t = 0.300 s; at the end it fails by")


def test_a_group_whose_steps_may_fail_still_ends_at_its_timeout(run: Run) -> None:
    """Its limit cuts the steps off; that they may fail does not excuse the group."""
    steps = "  - id: group\n    sequence:\n" + 2 * (LATE % "9 s" + "        on_fail: continue\n")
    late = run(steps + "    timeout: 0.4 s\n  - wait: 0.1 s\n")
    assert late.verdict == "failed"
    assert by_id(late)["group"].outcome == "timeout"
    assert late.text.startswith("sequence 'group' timed out: its limit of 400 ms was reached")
    assert run(steps + "    timeout: 0.4 s\n    on_fail: continue\n  - wait: 0.1 s\n").verdict == "passed"
    assert run(steps + "    timeout: 9 s\n  - wait: 0.1 s\n").verdict == "passed"


def test_a_run_that_ends_inside_a_group_does_not_wait_for_its_until(tmp_path: Path) -> None:
    file = tmp_path / "small.yaml"
    steps = "      - {id: a, move: {to: {pitch: 0.2}}}\n      - {id: b, move: {to: {pitch: 0.6}}}\n"
    until = "    until: {not: {at_pose: {pose: up, within: 0.5}}}\n    timeout: 6 s\n"
    file.write_text(f"{HEAD}steps:\n  - id: g\n    sequence:\n{steps}{until}")
    for last, moved in (("g/a", 0.2), ("g/b", 0.6)):
        verdict = pipeline.run_task(file, log=tmp_path / "small.mcap", force=True, until=last).verdict
        assert verdict.verdict == "passed", verdict.text
        assert verdict.simulated_time < 3.0
        states = read_recording(tmp_path / "small.mcap").states
        assert states.position[-1, 0] == pytest.approx(moved, abs=1e-3)


def test_with_more_than_eight_combinations_the_rest_is_planned_during_the_run(run: Run, tmp_path: Path) -> None:
    one = "  - if: {at_pose: {pose: up, within: 0.3}}\n    then:\n      - move: {to: {pitch: 0.5}}\n"
    one += "    else:\n      - move: {to: {pitch: 0.1}}\n"
    verdict = run(5 * one)
    assert verdict.verdict == "passed", verdict.text
    assert [block.taken for block in verdict.blocks] == ["then", "else", "then", "else", "then"]
    done = [step for step in verdict.steps if step.outcome == "done"]
    assert [step.planned_duration for step in done] == [
        pytest.approx(step.ended - step.started, abs=0.01)  # type: ignore[operator]
        for step in done
    ]
    assert not any(step.replanned for step in done)
    task = pipeline.load_task(tmp_path / "small.yaml")
    (finding,) = [finding for finding in task.findings if finding.code == "TASK280"]
    assert (finding.severity, str(finding.place).endswith("small.yaml:22:5")) == ("warning", True)
    plan = pipeline.plan_task(task)
    assert len(plan.combinations) == 8
    assert [step.planned_duration is None for step in plan.listed] == [False] * 6 + [True] * 4
    assert pipeline.verify_log(tmp_path / "small.mcap").identical


@pytest.mark.parametrize("first", ["arm", "hand"])
def test_two_steps_at_once_take_the_longer_of_their_times(run: Run, tmp_path: Path, first: str) -> None:
    parts = ["      - move: {to: {panda_joint1: 0.5}}\n", "      - grasp: {until: posture}\n"]
    text = "  - parallel:\n" + "".join(parts if first == "arm" else reversed(parts)) + "  - release: {}\n"
    verdict = run(text, PANDA)
    assert verdict.verdict == "passed", verdict.text
    a, b, after = verdict.steps
    assert a.started == b.started == 0.0
    longer = max(a.planned_duration or 0.0, b.planned_duration or 0.0)
    assert after.started == pytest.approx(longer, abs=0.01)
    assert a.ended != b.ended
    plan = pipeline.plan_task(pipeline.load_task(tmp_path / "small.yaml"))
    assert plan.duration == pytest.approx(longer + plan.steps[2].plan.duration)
    assert set(plan.merged.steps[0].id.split("+")) == {a.id, b.id}


def test_what_cannot_be_done_in_parallel_is_refused_at_its_place(tmp_path: Path) -> None:
    text = "  - parallel:\n      - move: {to: {panda_joint1: 0.5}}\n        on_fail: {retry: 1}\n      - %s\n"
    found = {}
    for part in ("move: {to: {panda_joint2: 0.1}}", "wait: 1 s", "move: {to: home}", "release: {}"):
        file = tmp_path / "small.yaml"
        file.write_text(PANDA + "steps:\n" + text % part)
        with pytest.raises(pipeline.InvalidInput) as refused:
            pipeline.load_task(file)
        found[part] = [(one.code, one.place.line if one.place else 0) for one in refused.value.findings]
    head = PANDA.count("\n")
    retried = ("TASK282", head + 4)
    assert found.pop("release: {}") == [retried]
    assert all(codes == [retried, ("TASK281", head + 5)] for codes in found.values()), found


def test_a_pose_of_all_joints_beside_a_part_of_the_hand_is_named_as_the_cause(tmp_path: Path) -> None:
    file = tmp_path / "small.yaml"
    file.write_text(PANDA + "steps:\n  - parallel: [{move: {to: home}}, {release: {}}]\n")
    with pytest.raises(pipeline.InvalidInput) as refused:
        pipeline.load_task(file)
    (one,) = refused.value.findings
    assert one.code == "TASK281" and "pose 'home' also moves the hand" in one.message
    assert one.hint and "name the arm's joints" in one.hint


def test_all_reports_show_the_blocks(run: Run, tmp_path: Path) -> None:
    verdict = run(IF % 0.2)
    text = render_verdict(verdict, "small.mcap")
    assert "✓ done     if_1                if: then" in text
    assert "– skipped    if_1/else/move_1" in text
    assert "if 'if_1' took then: it holds by 5.73 deg: at_pose: " in text
    (block,) = json.loads(json_report.render_verdict(verdict, "small.mcap"))["blocks"]
    assert (block["id"], block["taken"], block["steps"]) == ("if_1", "then", ["if_1/move_1", "if_1/else/move_1"])
    page = render_page(log_page(tmp_path / "small.mcap"))
    assert "if &#x27;if_1&#x27; took then" in page or "if 'if_1' took then" in page
    nowhere = [Written("")] * len(verdict.steps)
    suite = fromstring(render_junit(verdict, nowhere, []).decode()).find("testsuite")
    assert suite is not None
    cases = {case.get("name"): case for case in suite.findall("testcase")}
    assert cases["if_1/else/move_1"].find("skipped") is not None
    assert "took then" in (cases["if_1"].findtext("system-out") or "")
    assert suite.get("failures") == "0"


def test_a_watch_during_a_step_also_watches_its_second_attempt(run: Run) -> None:
    """In the first attempt the step stops at 0.44 rad, in the second it passes 0.6 rad."""
    text = "  - sequence:\n      - wait: 0.1 s\n      - move: {to: {pitch: 0.9}}\n        id: far\n"
    text += "        timeout: 0.2 s\n"
    watch = "watch:\n  - always: {at_pose: {pose: up, within: 0.7}}\n    during: sequence_1/far\n"
    verdict = run(text + "    on_fail: {retry: 2}\n" + watch)
    assert verdict.verdict == "failed"
    assert [one.outcome for one in verdict.steps[1].attempts] == ["timeout", "failed"]
    assert "stopped: 'watch_at_pose' is broken at " in verdict.text
    assert verdict.expectations[0].outcome == "failed"


def test_a_watch_that_breaks_while_a_choice_is_asked_ends_the_run(run: Run) -> None:
    watch = "watch:\n  - always: {duration: {below: 0.3 s}}\n"
    verdict = run(IF % 0.2 + watch)
    assert verdict.verdict == "failed"
    assert "stopped: 'watch_duration' is broken at t = 0.3" in verdict.text
    assert list(outcomes(verdict).values()) == ["done", "not_run", "not_run", "not_run"]


BLOCKS = f"""\
task: cubes
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
params: {{at: -0.1}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  cube: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, rests_on: table, at: [0.5, $at]}}
"""
TAKE = ["pick: {object: cube, approach: {from: top}}", "lift: {object: cube}"]
HERE = [*TAKE, "place: {object: cube, at: [0.6, 0.2], onto: table}"]
THERE = [*TAKE, "place: {object: cube, at: [0.45, 0.1], onto: table}"]
AFTER = ["move: {to: home}", "move: {to: {panda_joint1: 0.3}}"]


def listed(steps: list[str], indent: int) -> str:
    return "".join(f"{' ' * indent}- {step}\n" for step in steps)


CHOICE = (
    f"  - if: {{near: {{object: cube, to: [0.5, -0.1, 0.22], within: 5 cm}}}}\n    then:\n{listed(HERE, 6)}"
    f"    else:\n{listed(THERE, 6)}{listed(AFTER, 2)}"
)


def test_each_path_is_planned_as_the_flat_task(tmp_path: Path) -> None:
    """Byte-equal motions: `then` and the steps behind it, and `else` and those; also in a sequence and a repeat."""

    def planned(text: str) -> pipeline.Plan:
        (tmp_path / "task.yaml").write_text(BLOCKS + "steps:\n" + text)
        return pipeline.plan_task(pipeline.load_task(tmp_path / "task.yaml"))

    def motions(plan: pipeline.Plan) -> list[bytes]:
        return [motion.trajectory.positions.tobytes() for motion in plan.motions if motion.trajectory is not None]

    branches = planned(CHOICE)
    for outcome, steps in ((True, HERE), (False, THERE)):
        flat = motions(planned(listed([*steps, *AFTER], 2)))
        assert motions(branches.along((outcome,))) == flat
    grouped = f"  - sequence:\n{listed(HERE, 6)}  - repeat:\n      times: 1\n      steps:\n{listed(AFTER, 8)}"
    assert motions(planned(grouped)) == motions(branches)


@pytest.mark.slow
@pytest.mark.parametrize(("at", "where", "taken"), [(-0.1, [0.6, 0.2], "then"), (0.0, [0.45, 0.1], "else")])
def test_both_branches_are_done_in_physics(run: Run, tmp_path: Path, at: float, where: list[float], taken: str) -> None:
    expect = f"expect:\n  - near: {{object: cube, to: [{where[0]}, {where[1]}, 0.22], within: 5 mm}}\n"
    verdict = run(CHOICE + expect, BLOCKS.replace("at: -0.1", f"at: {at}"))
    assert verdict.verdict == "passed", verdict.text
    assert by_id(verdict)["if_1"].taken == taken


@pytest.mark.slow
def test_an_object_in_the_closed_hand_is_picked_again_in_the_next_attempt(run: Run) -> None:
    """The lift never has the time that it needs; the second attempt begins with the cube in the hand, in the air."""
    steps = listed(["release: {}", *TAKE], 6)
    group = f"  - sequence:\n{steps}        timeout: 0.45 s\n    on_fail: {{retry: 1}}\n"
    verdict = run(group, BLOCKS)
    assert [one.outcome for one in verdict.steps[1].attempts] == ["done", "done"]
    assert [one.outcome for one in verdict.steps[2].attempts] == ["timeout", "timeout"]
    assert verdict.steps[1].replanned  # from where the cube has fallen
