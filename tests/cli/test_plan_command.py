"""`manipcli plan`: what it shows of a plan, what it writes, and why there is none."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from manipcli.cli.app import main
from manipcli.core.geometry import Array
from manipcli.plan.planned_states import planned_states
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan, plan_task

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: made
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
start: home
simulation: {{engine: kinematic}}
"""
DESK = """\
scene:
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
"""
WALLED = (
    HEAD
    + DESK
    + """\
  wall: {box: {size: [2 cm, 0.8, 0.15]}, pose: {xyz: [0.62, 0, 0.475]}, fixed: true}
  can: {cylinder: {radius: 36 mm, height: 110 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}
steps:
  - pick: {object: can, approach: {from: side}, grasp: {posture: wrap, height: 68 mm}}
"""
)
FAR = HEAD + DESK + "steps:\n  - move: {pose: {xyz: [1.6, 0.3, 0.8]}}\n"
MOVES = HEAD + "steps:\n  - move: {to: zero}\n  - {id: back, move: {to: home, velocity_scaling: 0.5}}\n"

Write = Callable[[str], Path]


@pytest.fixture
def written(tmp_path: Path) -> Write:
    def write(text: str) -> Path:
        path = tmp_path / "task.yaml"
        path.write_text(text)
        return path

    return write


def planned(path: Path) -> Plan:
    return plan_task(load_task(path, allow_outside=True))


def test_a_wall_in_front_of_a_can(written: Write, capsys: pytest.CaptureFixture[str]) -> None:
    """Candidates are counted by stage, and the wall is named as what to move."""
    path = written(WALLED)
    assert main(["plan", str(path), "--allow-outside", "--format", "json"]) == 1
    found = json.loads(capsys.readouterr().out)
    counts = [group["count"] for group in found["candidates"]]
    assert counts == sorted(counts, reverse=True)
    assert sum(counts) > 5
    assert {group["step"] for group in found["candidates"]} == {"pick_1"}
    hint = found["errors"][0]["hint"]
    assert f"of {sum(counts)} candidates" in hint
    assert "move 'wall'" in hint
    assert main(["plan", str(path), "--allow-outside"]) == 1
    out = capsys.readouterr().out
    assert out.split()[:4] == ["refused", "step", "at", "because"]


@pytest.mark.parametrize("command", ["plan", "run", "check"])
def test_a_goal_out_of_reach(written: Write, capsys: pytest.CaptureFixture[str], command: str) -> None:
    """The base that is moved as the hint says makes the goal reachable."""
    assert main([command, str(written(FAR)), "--allow-outside"]) != 0
    output = "".join(capsys.readouterr())
    assert "with the tool at (" in output
    assert "with the base moved by " in output


def test_the_base_of_the_hint_is_enough(written: Write, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(FAR)
    main(["plan", str(path), "--allow-outside", "--format", "json"])
    hint = json.loads(capsys.readouterr().out)["errors"][0]["hint"]
    x, y = (float(hint.split(f"{axis} = ")[1].split(" m")[0]) for axis in "xy")
    moved = FAR.replace("0.85, 0, 0.2", "9, 9, 0.2").replace("[1.6, 0.3, 0.8]", f"[{1.6 - x}, {0.3 - y}, 0.8]")
    assert main(["plan", str(written(moved)), "--allow-outside"]) == 0


def test_margins_and_what_binds(written: Write, capsys: pytest.CaptureFixture[str]) -> None:
    """A motion at full speed uses all of one limit; one at half the speed half of it."""
    path = written(MOVES)
    assert main(["plan", str(path), "--allow-outside", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for motion, scale in zip(found["motions"], (1.0, 0.5), strict=True):
        used = {margin["quantity"]: margin["used"] for margin in motion["margins"]}
        assert max(used["velocity"], used["acceleration"]) == pytest.approx(scale, rel=0.02)
        assert all(0.0 <= margin["time"] <= motion["duration"] + 1e-9 for margin in motion["margins"])
        assert 0.2 < motion["bound_by"]["share"] <= 1.0
        assert motion["manipulability"]["least"] >= 0.0
    assert [step["dropped"] for step in found["steps"]] == [[], []]


def test_torques_are_those_of_holding_still(written: Write) -> None:
    """Oracle: at rest, torque is gravity; with a carried body, its weight times the Jacobian of its centre."""
    text = HEAD + DESK
    text += "  can: {cylinder: {radius: 36 mm, height: 110 mm}, mass: 500 g, rests_on: desk, at: [0.75, 0.0]}\n"
    text += "steps:\n  - pick: {object: can, grasp: {posture: wrap, height: 68 mm}}\n"
    text += "  - lift: {object: can}\n  - wait: 0.1 s\n"
    plan = planned(written(text))
    motion, before, end = plan.spans()[-1]
    states = planned_states(plan.planner, motion, end, begins=before)
    kinematics = plan.planner.kinematics
    carried = before.carried
    assert carried is not None

    def height(q: Array) -> float:
        return float((kinematics.forward(q, carried.link) @ carried.X_LO).p[2])

    q = np.array(before.position)
    slope = np.zeros(len(q))
    for k in range(len(q)):
        step = np.zeros(len(q))
        step[k] = 1e-6
        slope[k] = (height(q + step) - height(q - step)) / 2e-6
    expected = np.array(kinematics.gravity(q)) + 0.5 * 9.81 * slope
    np.testing.assert_allclose(states.torque[0], expected, atol=2e-2)


def test_exported_messages_give_the_same_plan(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(MOVES)
    before = planned(path)
    folder = tmp_path / "out"
    assert main(["plan", str(path), "--allow-outside", "--export", "jointtrajectory", "--to", str(folder)]) == 0
    files = sorted(folder.iterdir())
    assert [file.name for file in files] == ["01_move_1.yaml", "02_back.yaml"]
    steps = [{"follow": yaml.safe_load(file.read_text())} for file in files]
    after = planned(written(HEAD + yaml.safe_dump({"steps": steps}, sort_keys=False)))
    for one, other in zip(before.motions, after.motions, strict=True):
        assert one.trajectory is not None
        assert other.trajectory is not None
        assert other.duration == pytest.approx(one.duration, abs=1e-8)
        for name in one.trajectory.names:
            p, q = (t.positions[:, t.names.index(name)] for t in (one.trajectory, other.trajectory))
            t, u = one.trajectory.times, other.trajectory.times
            np.testing.assert_allclose(np.interp(t, u, q), p, atol=1e-6)


def test_pictures_and_pages_are_written_and_reproducible(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(MOVES)
    files = [(tmp_path / f"{k}.svg", tmp_path / f"{k}.html") for k in range(2)]
    for picture, page in files:
        assert main(["plan", str(path), "--allow-outside", "--curves", str(picture), "--html", str(page)]) == 0
    assert files[0][0].read_bytes() == files[1][0].read_bytes()
    assert files[0][1].read_bytes() == files[1][1].read_bytes()
    assert "planned, not simulated" in files[0][1].read_text()


@pytest.mark.slow
def test_the_scene_is_drawn_with_and_without_a_plan(
    written: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "scene.png"
    words = ["--allow-outside", "--picture", str(picture), "--view", "front"]
    assert main(["plan", str(written(MOVES)), *words]) == 0
    planned_bytes = picture.read_bytes()
    assert planned_bytes.startswith(b"\x89PNG")
    assert main(["plan", str(written(FAR)), *words]) == 1
    assert picture.read_bytes() != planned_bytes
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--picture", "a.svg"], "USE063", "`--curves FILE`"),
        (["--view", "top"], "USE062", "add --picture"),
        (["--picture", "a.png", "--view", "below"], "REPLAY010", "iso, front"),
        (["--curves", "a.webp"], "USE061", ".svg"),
    ],
)
def test_what_cannot_be_drawn_is_refused(
    written: Write, capsys: pytest.CaptureFixture[str], words: list[str], code: str, says: str
) -> None:
    assert main(["plan", str(written(MOVES)), "--allow-outside", *words]) == 4
    told = capsys.readouterr().err
    assert f"error[{code}]" in told
    assert says in told


def test_to_needs_export(written: Write, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", str(written(MOVES)), "--allow-outside", "--to", "x"]) == 4
    assert "--to has no effect without --export" in capsys.readouterr().err


def test_a_constraint_of_a_step_binds_its_motion(written: Write) -> None:
    """Slow enough, the tool is at its speed limit for nearly all of the time; without, a joint binds."""
    turn, back = "move: {to: {joint_1: 10 deg}}", "{move: {to: home}, keep: {tool_speed: 0.1}}"
    free, slow = planned(written(f"{HEAD}steps:\n  - {turn}\n  - {back}\n")).margins()
    assert free.binding is not None and slow.binding is not None
    assert free.binding.joint == "joint_1"
    assert (slow.binding.joint, slow.binding.quantity) == ("tool", "tool_speed")
    assert slow.binding.share > 0.8  # the rest: it starts and stops


def test_a_pose_beyond_a_joint_limit_names_the_joint(written: Write, capsys: pytest.CaptureFixture[str]) -> None:
    """The pose is reached until the limits of one joint are narrowed."""
    path = str(written(HEAD + "steps:\n  - move: {pose: {xyz: [0.3, 0, 0.5], rpy: [180 deg, 0, 0]}}\n"))
    assert main(["plan", path, "--allow-outside"]) == 0
    narrow = "robot.limits.joint_4={lower: -1.65, upper: 0.05}"
    capsys.readouterr()
    assert main(["plan", path, "--allow-outside", "--set", narrow]) == 1
    told = capsys.readouterr().err
    assert "joint_4" in told.split("at the limits of ")[1].split(", with the tool at")[0]
