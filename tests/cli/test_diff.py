"""`manipcli diff A B` as a person meets it, on runs without physics."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.records import Message

from manipcli.cli.app import main
from manipcli.pipeline import run_task

ROOT = Path(__file__).parents[2]
Rewrite = Callable[..., Path]
TASK = (
    "task: nod\nrobot: {root}/robots/differential_wrist/robot.yaml\n"
    "controllers: {root}/controllers/differential_wrist.yaml\nsimulation: {{engine: kinematic}}\n"
    "steps:\n  - move: {{to: {{pitch: 0.3}}}}\n  - wait: 0.1 s\nexpect: [{{duration: {{below: 20 s}}}}]\n"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("diff")
    (folder / "nod.yaml").write_text(TASK.format(root=ROOT))
    for name, overrides in (("a", []), ("b", ["steps.0.move.to.pitch=0.4"]), ("c", ["expect.0.duration.below=0.1 s"])):
        run_task(folder / "nod.yaml", overrides=overrides, log=folder / f"{name}.mcap")
    return folder


@pytest.mark.slow
def test_a_log_and_its_copy_are_the_same(
    folder: Path, tmp_path: Path, rewrite_log: Rewrite, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = rewrite_log(folder / "a.mcap", tmp_path / "copy.mcap", chunk_size=10_000)
    assert main(["diff", str(folder / "a.mcap"), str(copy)]) == 0
    out = capsys.readouterr().out
    assert "✓ no difference" in out
    assert "+" not in out.split("no difference")[0].split("step")[1]


@pytest.mark.slow
def test_another_motion_is_told_by_step_and_from_when_on(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = (str(folder / f"{name}.mcap") for name in "ab")
    assert main(["diff", a, b, "--format", "json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert not found["same"]
    move, wait = found["steps"]
    assert (move["id"], wait["id"]) == ("move_1", "wait_1")
    assert [move[side]["turned"] for side in "ab"] == pytest.approx([0.3, 0.4], abs=1e-9)
    assert move["a"]["duration"] < move["b"]["duration"]
    assert "task.yaml" in [one["name"] for one in found["made_from"]]
    joints = next(topic for topic in found["topics"] if topic["name"] == "/joint_states")
    assert joints["first"]["time"] < 0.1
    assert joints["first"]["field"] == "position[pitch]" or joints["first"]["field"].startswith("velocity[")
    assert main(["diff", a, b]) == 1
    out = capsys.readouterr().out
    assert "input: attachment 'task.yaml', line " in out
    assert "0.3 rad +0.1" in out
    assert "✗ first difference: t = 0" in out


@pytest.mark.slow
def test_a_tolerance_lets_small_numbers_be(
    folder: Path, tmp_path: Path, rewrite_log: Rewrite, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(topic: str, one: Message) -> bytes:
        if topic != "/joint_states":
            return one.data
        (value,) = struct.unpack_from("<d", one.data, len(one.data) - 8)
        return one.data[:-8] + struct.pack("<d", value + 1e-6)

    a = str(folder / "a.mcap")
    other = str(rewrite_log(folder / "a.mcap", tmp_path / "other.mcap", message=change))
    assert main(["diff", a, other]) == 1
    assert "effort[roll]" in capsys.readouterr().out
    assert main(["diff", a, other, "--tolerance", "1e-7"]) == 1
    assert main(["diff", a, other, "--tolerance", "2e-6"]) == 0
    assert "no difference within 2e-06" in capsys.readouterr().out
    assert main(["diff", a, other, "--tolerance", "-1"]) == 4


def test_where_it_was_written_is_nothing_that_happened(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Another name of the file, and a line more; while another step at the same place, or words said of it, count."""
    (folder / "nods.yaml").write_text("# once more\n" + TASK.format(root=ROOT))
    run_task(folder / "nods.yaml", log=folder / "moved.mcap")
    assert main(["diff", str(folder / "a.mcap"), str(folder / "moved.mcap")]) == 0
    assert "✓ no difference" in capsys.readouterr().out
    run_task(folder / "nods.yaml", overrides=["steps.0.id=bow"], log=folder / "named.mcap")
    assert main(["diff", str(folder / "a.mcap"), str(folder / "named.mcap"), "--format", "json"]) == 1
    topics = json.loads(capsys.readouterr().out)["topics"]
    firsts = {topic["name"]: topic["first"]["field"] for topic in topics if topic["first"]}
    assert firsts["/task/events"] == "step"
    assert firsts["/rosout"] == "msg"


def test_the_same_motion_judged_otherwise_is_different(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", str(folder / "a.mcap"), str(folder / "c.mcap")]) == 1
    out = capsys.readouterr().out
    assert "same messages, different verdict" in out
    assert "duration     passed" in out
    assert "failed" in out


def test_other_robots_are_told_and_what_is_no_run_is_compared_by_messages(
    folder: Path, tmp_path: Path, rewrite_log: Rewrite, capsys: pytest.CaptureFixture[str]
) -> None:
    task = tmp_path / "other.yaml"
    text = TASK.format(root=ROOT).replace("differential_wrist", "four_bar_finger")
    task.write_text(text.replace("{pitch: 0.3}", "{proximal: 0.3}").replace("task: nod", "task: bend"))
    run_task(task, log=tmp_path / "other.mcap")
    assert main(["diff", str(folder / "a.mcap"), str(tmp_path / "other.mcap")]) == 1
    out = capsys.readouterr().out
    assert "messages are not compared: the joints differ (pitch, roll" in out
    assert "the tasks differ" in out
    bare = rewrite_log(folder / "a.mcap", tmp_path / "bare.mcap", metadata=lambda name, _: None)
    assert main(["diff", str(folder / "a.mcap"), str(bare)]) == 0
    out = capsys.readouterr().out
    assert "bare.mcap not written by manipcli: only messages are compared" in out
    assert "✓ no difference" in out
    assert "and the verdict on them" not in out
    assert main(["diff", str(bare), str(bare)]) == 0
    assert "bare.mcap and bare.mcap not written by manipcli" in capsys.readouterr().out
    (tmp_path / "text").write_text("hello")
    assert main(["diff", str(bare), str(tmp_path / "text")]) == 4
