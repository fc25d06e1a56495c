"""A run from a step on begins with the recorded state, ends where the whole run ended, and says what it is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.cli.app import main
from manipcli.core.errors import InvalidInput
from manipcli.judge.verdict import StepOutcome, Verdict
from manipcli.logs.part_of import task_part
from manipcli.pipeline import judge_log, run_task, verify_log
from manipcli.record.read.reading import read_recording
from manipcli.record.recording import Recording
from manipcli.record.start_state import START_STATE, StartState
from manipcli.spec.block import BlockKind, BlockSpec
from manipcli.task.load_task import load_task

PICK_PLACE = Path(__file__).parents[2] / "tasks/pick_place.yaml"
REACHER = Path(__file__).parents[2] / "examples/04_own_robot"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Verdict, Recording]:
    """The whole run: its log, its verdict and its recording."""
    log = tmp_path_factory.mktemp("whole") / "whole.mcap"
    return log, run_task(PICK_PLACE, log=log).verdict, read_recording(log)


@pytest.fixture(scope="module")
def placed(whole: tuple[Path, Verdict, Recording], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Verdict]:
    """The step that places the block, alone; it begins with the block in the hand, above the table."""
    log = tmp_path_factory.mktemp("part") / "part.mcap"
    report = run_task(PICK_PLACE, log=log, from_step="place_1", until="place_1", state=whole[0])
    return log, report.verdict


def step(verdict: Verdict, name: str) -> StepOutcome:
    return next(outcome for outcome in verdict.steps if outcome.id == name)


def tick(recording: Recording, time: float | None) -> int:
    assert time is not None
    return int(np.searchsorted(recording.states.time, time + 1e-9)) - 1


def test_the_first_tick_is_the_recorded_one(
    whole: tuple[Path, Verdict, Recording], placed: tuple[Path, Verdict]
) -> None:
    before, after = whole[2], read_recording(placed[0])
    k = tick(before, step(whole[1], "place_1").started)
    for name, within in (("position", 0.0), ("velocity", 0.0), ("body_position", 1e-15), ("body_quat_xyzw", 1e-15)):
        ours, theirs = getattr(after.states, name)[0], getattr(before.states, name)[k]
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=within)
    for ours, theirs in zip(after.controllers, before.controllers, strict=True):
        np.testing.assert_array_equal(ours.reference_position[0], theirs.reference_position[k])


def test_the_step_ends_as_in_the_whole_run(
    whole: tuple[Path, Verdict, Recording], placed: tuple[Path, Verdict]
) -> None:
    """The block is never dropped, and lies within 1 mm of where it lay."""
    before, after = whole[2], read_recording(placed[0])
    ends = [tick(before, step(whole[1], "place_1").ended), tick(after, step(placed[1], "place_1").ended)]
    poses = [recording.states.body_position[k] for recording, k in zip((before, after), ends, strict=True)]
    np.testing.assert_allclose(poses[0], poses[1], atol=1e-3)
    first = after.states.time < 0.1
    assert np.ptp(after.states.body_position[first], axis=0).max() < 1e-3


def test_it_is_deterministic_and_verified_from_its_own_contents(
    whole: tuple[Path, Verdict, Recording], placed: tuple[Path, Verdict], tmp_path: Path
) -> None:
    copy = tmp_path / "whole.mcap"
    copy.write_bytes(whole[0].read_bytes())
    again = tmp_path / "part.mcap"
    run_task(PICK_PLACE, log=again, from_step="place_1", until="place_1", state=copy)
    assert again.read_bytes() == placed[0].read_bytes()
    copy.unlink()
    verification = verify_log(again)
    assert verification.messages.same
    assert not verification.entries


def test_verdict_and_log_state_what_was_run(
    whole: tuple[Path, Verdict, Recording], placed: tuple[Path, Verdict]
) -> None:
    verdict = placed[1]
    assert verdict == judge_log(placed[0])
    assert verdict.verdict == "passed"
    assert [outcome.outcome for outcome in verdict.steps] == ["not_run", "not_run", "done", "not_run"]
    assert step(verdict, "lift_1").text == "before 'place_1', where this run starts"
    assert step(verdict, "move_1").text == "after 'place_1', where this run ends"
    assert {expectation.outcome for expectation in verdict.expectations} == {"not_evaluated"}
    assert "not the uninterrupted run; stopped after 'place_1' as asked" in verdict.text
    recording = read_recording(placed[0])
    state = StartState.from_json(recording.attachments[START_STATE])
    part = recording.metadata["part"]
    assert (state.held, state.closed, state.step, state.log) == ("block", True, "place_1", "whole.mcap")
    assert (part["from"], part["until"], part["origin_sha256"]) == ("place_1", "place_1", state.sha256)
    assert float(part["origin_time"]) == state.time == pytest.approx(step(whole[1], "place_1").started)


def test_a_changed_task_can_begin_with_the_state_if_joints_and_bodies_are_the_same(
    whole: tuple[Path, Verdict, Recording], tmp_path: Path
) -> None:
    other = tmp_path / "other.yaml"
    text = PICK_PLACE.read_text().replace("../", f"{PICK_PLACE.parents[1]}/")
    other.write_text(
        text.replace(
            "  block:", "  ball: {sphere: {radius: 1 cm}, mass: 10 g, rests_on: table, at: [0.4, 0.2]}\n  block:"
        )
    )
    with pytest.raises(InvalidInput, match="movable body 'ball' is only in the task"):
        run_task(other, log=tmp_path / "a.mcap", from_step="move_1", state=whole[0])
    changed = ("steps.2.place.at=[0.52, 0.18]",)
    report = run_task(
        PICK_PLACE, log=tmp_path / "b.mcap", from_step="place_1", until="place_1", state=whole[0], overrides=changed
    )
    end = read_recording(tmp_path / "b.mcap").states.body_position[-1, 0]
    assert report.verdict.verdict == "passed"
    np.testing.assert_allclose(end[:2], [0.52, 0.18], atol=0.01)


TASK = f"""\
task: waves
robot: {REACHER}/robot.yaml
controllers: controllers.yaml
simulation: {{engine: kinematic}}
steps:
  - {{id: up, move: {{to: {{pan: 0.3}}}}}}
  - {{id: down, move: {{to: {{pan: -0.2}}}}}}
  - {{id: other, switch_controllers: second}}
  - {{id: last, move: {{to: {{pan: 0.1}}}}}}
expect:
  - {{id: early, at: up, duration: {{below: 20 s}}}}
  - {{id: late, step_done: {{step: last}}}}
  - {{id: end, at: end, limits: {{of: [position, velocity]}}}}
  - {{id: total, duration: {{below: 60 s}}}}
  - {{id: all, limits: {{of: [position, velocity]}}}}
"""


@pytest.fixture(scope="module")
def waves(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A task whose second part has another controller, and its log in `runs/`."""
    folder = tmp_path_factory.mktemp("waves")
    law = "{type: joint_trajectory, command_interface: position, joints: [pan, shoulder, elbow]"
    (folder / "controllers.yaml").write_text(f"controllers:\n  first: {law}}}\n  second: {law}, active: false}}\n")
    (folder / "waves.yaml").write_text(TASK)
    assert run_task(folder / "waves.yaml", log=folder / "whole.mcap").verdict.verdict == "passed"
    return folder


@pytest.mark.parametrize(
    ("first", "last", "evaluated"),
    [
        (None, "up", {"early", "all"}),
        ("down", None, {"late", "end", "all"}),
        ("last", None, {"late", "end", "all"}),
        ("down", "other", {"all"}),
    ],
)
def test_expectations_about_other_steps_are_not_evaluated(
    waves: Path, tmp_path: Path, first: str | None, last: str | None, evaluated: set[str]
) -> None:
    log = tmp_path / "part.mcap"
    report = run_task(waves / "waves.yaml", log=log, from_step=first, until=last, state=waves / "whole.mcap")
    assert report.verdict.verdict == "passed"
    assert {one.name for one in report.verdict.expectations if one.outcome == "passed"} == evaluated
    assert all(one.excused == (one.name not in evaluated) for one in report.verdict.expectations)
    assert same_again(log)


@pytest.mark.parametrize(("within", "found"), [(2.0, "not_evaluated"), (0.01, "failed")])
def test_what_must_hold_throughout_several_steps_fails_in_those_that_were_run(
    waves: Path, tmp_path: Path, within: float, found: str
) -> None:
    """The rest of the steps cannot mend it; where it holds so far, they may still break it."""
    task = waves / f"throughout_{found}.yaml"
    expect = f"expect:\n  - always: {{at_pose: {{pose: up, within: {within}}}}}\n    during: [up, down]\n"
    task.write_text(TASK.partition("expect:")[0] + expect)
    verdict = run_task(task, log=tmp_path / "part.mcap", until="up").verdict
    (one,) = verdict.expectations
    assert (one.outcome, one.excused) == (found, found == "not_evaluated")
    assert verdict.verdict == ("failed" if found == "failed" else "passed")
    assert judge_log(tmp_path / "part.mcap") == verdict


def same_again(log: Path) -> bool:
    verification = verify_log(log)
    return verification.messages.same and not verification.entries


def test_the_active_controllers_are_those_of_the_state(waves: Path, tmp_path: Path) -> None:
    log = tmp_path / "part.mcap"
    run_task(waves / "waves.yaml", log=log, from_step="last", state=waves / "whole.mcap")
    one, other = read_recording(log).controllers
    assert np.isnan(one.reference_position).all()
    assert np.isfinite(other.reference_position).all()
    assert other.reference_position[0, 0] == pytest.approx(-0.2, abs=1e-6)


def test_a_run_until_a_step_has_the_state_of_the_next(waves: Path, tmp_path: Path) -> None:
    run_task(waves / "waves.yaml", log=tmp_path / "until.mcap", until="up")
    log = tmp_path / "from.mcap"
    verdict = run_task(waves / "waves.yaml", log=log, from_step="down", state=tmp_path / "until.mcap").verdict
    assert verdict.verdict == "passed"
    assert read_recording(log).states.position[0, 0] == pytest.approx(0.3, abs=1e-6)
    with pytest.raises(InvalidInput, match="step 'last' never started in this run"):
        run_task(waves / "waves.yaml", log=tmp_path / "no.mcap", from_step="last", state=tmp_path / "until.mcap")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--from", "dwn", "--state", "whole.mcap"], "did you mean 'down'?"),
        (["--until", "ups"], "did you mean 'up'?"),
        (["--from", "last", "--until", "up", "--state", "whole.mcap"], "--until 'up' is before --from 'last'"),
        (["--from", "last"], "no log 'runs/waves.mcap' with the state before 'last'"),
        (["--from", "last", "--state", "waves.yaml"], "not an MCAP"),
        (["--state", "whole.mcap"], "--state needs --from STEP"),
        (["--until", "up", "--engines", "kinematic,pybullet"], "without --engines"),
    ],
)
def test_what_cannot_be_run_is_refused_with_a_hint(
    waves: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    told: str,
) -> None:
    monkeypatch.chdir(waves)
    assert main(["run", "waves.yaml", "--log", "new.mcap", *options]) == 4
    assert told in capsys.readouterr().err
    assert not (waves / "new.mcap").exists()


@pytest.mark.parametrize(
    ("kind", "first", "last", "fits"),
    [
        ("if", "down", None, False),
        ("if", None, "other", False),
        ("parallel", "down", None, True),
        ("parallel", "other", None, False),
        ("parallel", None, "down", False),
        ("parallel", None, "other", True),
        ("sequence", "other", "other", True),
    ],
)
def test_a_part_does_not_begin_or_end_inside_a_branch(
    waves: Path, kind: BlockKind, first: str | None, last: str | None, fits: bool
) -> None:
    """The block has the steps `down` and `other`."""
    task = load_task(waves / "waves.yaml")
    block = BlockSpec(id="b", kind=kind, word=kind, first=1, last=3, split=2)
    spec = task.spec.model_copy(update={"blocks": (block,)})
    task = replace(task, file=replace(task.file, spec=spec))
    if fits:
        part = task_part(task, first=first, last=last, log=waves / "whole.mcap")
        assert (part.first, part.last) == (1 if first == "down" else 2 if first else 0, 3 if last == "other" else None)
    else:
        with pytest.raises(InvalidInput, match=f"is inside `{kind}` 'b'"):
            task_part(task, first=first, last=last, log=waves / "whole.mcap")


def test_a_damaged_state_is_refused(whole: tuple[Path, Verdict, Recording], placed: tuple[Path, Verdict]) -> None:
    content = read_recording(placed[0]).attachments[START_STATE]
    state = StartState.from_json(content)
    assert state.to_json() == content
    for bad in (b"", b"{}", content[:-10], content.replace(b'"position": [', b'"position": [0.0,')):
        with pytest.raises(ValueError, match="damaged"):
            StartState.from_json(bad)


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("position", 10**400, "damaged"),
        ("time", 10**400, "damaged"),
        ("position", float("nan"), "a number is missing or not finite"),
        ("reference", float("inf"), "a number is above 1e\\+06"),
        ("poses", 1e300, "a number is above 1e\\+06"),
        ("poses", 0.0, "a quaternion is not of length 1"),
        ("held", "nobody", "it holds 'nobody', which is not one of its bodies"),
    ],
)
def test_a_state_that_no_run_reaches_is_refused(
    placed: tuple[Path, Verdict], key: str, value: object, told: str
) -> None:
    """A log is from anybody: its numbers must not reach an engine, nor its names a table of bodies."""
    content = json.loads(read_recording(placed[0]).attachments[START_STATE])
    old = content[key]
    if isinstance(old, list):
        old[0] = [value] * 7 if isinstance(old[0], list) else value
    else:
        content[key] = value
    with pytest.raises(ValueError, match=told):
        StartState.from_json(json.dumps(content).encode())


def test_a_log_whose_state_was_damaged_is_not_verified(waves: Path, rewrite_log: Any, tmp_path: Path) -> None:
    log, bad = tmp_path / "part.mcap", tmp_path / "bad.mcap"
    run_task(waves / "waves.yaml", log=log, from_step="last", state=waves / "whole.mcap")

    def attached(change: Callable[[bytes], bytes | None]) -> Path:
        return rewrite_log(log, bad, attachment=lambda name, data: change(data) if name == START_STATE else data)

    for change, told in (
        (lambda _: None, "has no start state"),
        (lambda data: data[:-10], "has a damaged start_state.json"),
        (lambda data: data.replace(b'"elbow"', b'"other"'), "has a start state of other joints or bodies"),
    ):
        with pytest.raises(InvalidInput, match=told):
            verify_log(attached(change))
    rewrite_log(log, bad, metadata=lambda name, values: {**values, "from": "none"} if name == "part" else values)
    with pytest.raises(InvalidInput, match="names step 'none', which its task does not have"):
        verify_log(bad)
