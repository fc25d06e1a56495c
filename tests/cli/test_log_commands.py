"""`info`, `repair` and `at` as a person meets them, on a log of a run without physics."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagWriter
from rosbags.typesys import Stores, get_typestore

from manipcli.cli.app import main
from manipcli.pipeline import run_task
from manipcli.record.read.reading import open_recording, read_recording

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One move and one wait of the arm, on the ideal engine."""
    folder = tmp_path_factory.mktemp("run")
    task = folder / "task.yaml"
    task.write_text(
        f"task: wave\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
        "simulation: {engine: kinematic}\n"
        "scene:\n  cube: {box: {size: [0.05, 0.05, 0.05]}, mass: 0.1, pose: {xyz: [0.8, 0.5, 0.025]}}\n"
        "steps:\n  - move: {to: {joint_1: 0.3}}\n  - wait: 0.2 s\n"
        "expect: [{duration: {below: 20 s}}]\n"
    )
    return task


@pytest.fixture(scope="module")
def log(task: Path) -> Path:
    """Its log."""
    path = task.with_name("wave.mcap")
    assert run_task(task, log=path).verdict.verdict == "passed"
    return path


def test_info_tells_verdict_steps_topics_and_sizes(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(log)]) == 0
    text = capsys.readouterr().out
    assert "✓ wave passed" in text
    assert "missing" not in text
    assert any(line.split()[:2] == ["/joint_states", "sensor_msgs/msg/JointState"] for line in text.splitlines())
    assert main(["info", str(log), "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["size"] == log.stat().st_size
    assert found["verdict"]["verdict"] == "passed"
    assert [step["outcome"] for step in found["steps"]] == ["done", "done"]
    (joints,) = [topic for topic in found["topics"] if topic["name"] == "/joint_states"]
    assert joints["rate"] == pytest.approx(1000.0)
    assert joints["messages"] == round(1000 * found["duration"]) + 1
    assert found["size_per_minute"] == pytest.approx(60 * found["size"] / found["duration"])


def test_a_cut_log_is_told_repaired_and_never_passes(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = log.read_bytes()
    cut = tmp_path / "run.mcap.partial"
    cut.write_bytes(data[: len(data) * 3 // 4])
    assert main(["info", str(cut)]) == 0
    assert "missing: the file is not finished" in capsys.readouterr().out
    assert main(["repair", str(cut)]) == 0
    assert "lost after t = " in capsys.readouterr().out
    clean = tmp_path / "run.repaired.mcap"
    assert main(["judge", str(clean)]) == 3
    assert "repaired with losses" in capsys.readouterr().out
    assert main(["repair", str(cut)]) == 4, "what exists stays"
    assert "the file exists" in capsys.readouterr().err
    assert main(["repair", str(log), "-o", str(clean), "--force", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["losses"] == []
    assert main(["judge", str(clean)]) == 0


@pytest.mark.parametrize("command", ["info", "repair", "judge"])
def test_what_is_no_log_is_refused(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    (tmp_path / "text").write_text("hello")
    for name, why in (("pipe", "not a regular file"), ("text", "not an MCAP file"), ("absent", "No such file")):
        assert main([command, str(tmp_path / name)]) == 4
        assert why in capsys.readouterr().err


@pytest.mark.parametrize("folder", [".", "/", ".."])
def test_a_folder_is_no_log_and_no_place_for_one(
    folder: str, task: Path, tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for command in (["judge", folder], ["info", folder], ["replay", folder], ["diff", folder, str(log)]):
        assert main(command) == 4
        assert "folder" in capsys.readouterr().err, command
    for command in (["run", str(task), "--log", folder], ["repair", str(log), "--output", folder]):
        assert main(command) == 4
        assert "s a directory" in capsys.readouterr().err, command
    assert main(["repair", folder]) == 4
    assert not [*tmp_path.iterdir()]


def test_at_tells_joints_bodies_and_the_step(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["at", str(log), "0s"]) == 0
    text = capsys.readouterr().out
    assert "step 'move_1' (move), phase 'move'" in text
    assert "cube  world  800.00, 500.00, 25.00 mm" in text
    last = read_recording(log).states
    assert main(["at", str(log), repr(float(last.time[-1])), "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [joint["position"] for joint in found["joints"]] == pytest.approx(last.position[-1].tolist(), abs=1e-9)
    (turned,) = [joint for joint in found["joints"] if joint["name"] == "joint_1"]
    assert turned["position"] == pytest.approx(0.3)
    assert turned["error"] == pytest.approx(0.0, abs=1e-9)
    assert turned["unit"] == "rad"
    assert found["step"] is None
    assert found["contacts"] == []
    assert main(["at", str(log), "1000"]) == 4
    assert "1000 s is outside the log wave.mcap" in capsys.readouterr().err
    for word in ("soon", "3 mm", "nan"):
        assert main(["at", str(log), word]) == 4


def test_at_takes_a_step_as_it_ends(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = read_recording(log)
    ended = {one.step: one.time for one in recording.events if one.kind == "step_ended"}
    for step in ("move_1", "wait_1"):
        assert main(["at", str(log), step, "--format", "json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["step"] == step
        assert found["time"] == pytest.approx(ended[step] - recording.period, abs=1e-6)
    assert main(["at", str(log), "mvoe_1"]) == 4
    assert "did you mean 'move_1'?" in capsys.readouterr().err


def test_somebody_else_s_log_is_told_as_far_as_it_goes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two publishers of joints and one frame, in wall time, by the rosbags library; a description with a slide."""
    store = get_typestore(Stores.ROS2_JAZZY)
    began = 1_700_000_000_000_000_000
    urdf = "<robot name='r'><link name='a'/><link name='b'/><joint name='lift' type='prismatic'/></robot>"
    types = store.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "map")

    def joints(names: list[str], position: list[float]) -> object:
        none = np.zeros(0)
        return types["sensor_msgs/msg/JointState"](header, names, np.array(position), none, none)

    quat = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    place = types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](1.0, 2.0, 3.0), quat)
    frame = types["geometry_msgs/msg/TransformStamped"](header, "tool", place)
    messages = [
        ("/robot_description", 0, types["std_msgs/msg/String"](urdf)),
        ("/joint_states", 0, joints(["lift"], [0.1])),
        ("/joint_states", 1, joints(["wheel"], [5.0])),
        ("/tf", 1, types["tf2_msgs/msg/TFMessage"]([frame])),
        ("/joint_states", 2, joints(["lift"], [0.2])),
    ]
    with RosbagWriter(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        types_of = {topic: message.__msgtype__ for topic, _, message in messages}
        channels = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in types_of.items()}
        for topic, second, message in messages:
            data = store.serialize_cdr(message, message.__msgtype__)
            writer.write(channels[topic], began + second * 1_000_000_000, data)
    (path,) = (tmp_path / "bag").glob("*.mcap")
    assert main(["at", str(path), "1.5 s", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {joint["name"]: (joint["position"], joint["unit"]) for joint in found["joints"]} == {
        "lift": (0.1, "m"),
        "wheel": (5.0, None),
    }
    assert [(pose["name"], pose["parent"], pose["xyz"]) for pose in found["poses"]] == [
        ("tool", "map", [1.0, 2.0, 3.0])
    ]
    assert found["contacts"] is None
    assert main(["at", str(path), "2"]) == 0
    assert "lift   200.000 mm" in capsys.readouterr().out
    assert main(["info", str(path)]) == 0
    text = capsys.readouterr().out
    assert "missing: not written by manipcli" in text
    assert "/joint_states" in text


@pytest.mark.slow
def test_the_log_to_stdout_is_the_log_and_the_report_goes_to_stderr(
    task: Path, log: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    assert main(["run", str(task), "--log", "-", "--quiet"]) == 0
    written = capfdbinary.readouterr()
    assert written.out == log.read_bytes()
    assert "log: stdout" in written.err.decode()
    assert "wave passed" in written.err.decode()
    assert main(["run", str(task), "--log", "-", "--format", "json"]) == 4
    assert b"both write to stdout" in capfdbinary.readouterr().out


@pytest.mark.slow
def test_a_run_ends_when_the_reader_of_its_log_goes_away(task: Path, tmp_path: Path) -> None:
    """To wait for an hour takes minutes."""
    long = tmp_path / "long.yaml"
    long.write_text(task.read_text().replace("wait: 0.2 s", "wait: 1 h"))
    words = [sys.executable, "-m", "manipcli", "run", str(long), "--log", "-", "--quiet"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        assert run.stdout is not None and run.stderr is not None
        assert len(run.stdout.read(1000)) == 1000
        run.stdout.close()
        told = run.stderr.read().decode()
        assert run.wait(60) == 3
    assert "error[LOG201]" in told and "not run" not in told


@pytest.mark.slow
def test_a_log_whose_reader_goes_away_is_lost(task: Path) -> None:
    words = [sys.executable, "-m", "manipcli", "run", str(task), "--log", "-", "--quiet"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        assert run.stdout is not None and run.stderr is not None
        assert len(run.stdout.read(1000)) == 1000
        run.stdout.close()
        told = run.stderr.read().decode()
        assert run.wait(60) == 3
    assert told.rstrip().endswith(
        "error[LOG201]: standard output: the log is incomplete: its reader closed the pipe before the end\n"
        "more about a code: manipcli explain LOG201"
    )


def test_a_summary_with_a_wrong_checksum_is_told_and_not_used(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = bytearray(log.read_bytes())
    data[-12] ^= 0xFF  # the checksum stands before the last eight bytes
    changed = tmp_path / "changed.mcap"
    changed.write_bytes(data)
    for words in (["judge", str(changed)], ["replay", str(changed), "--html", str(tmp_path / "page.html")]):
        assert main(words) == 0
        assert "the summary does not fit its checksum" in capsys.readouterr().err


def test_a_log_with_its_meshes_holds_every_file(task: Path, tmp_path: Path, log: Path) -> None:
    path = tmp_path / "full.mcap"
    assert main(["run", str(task), "--log", str(path), "--embed-meshes", "--quiet"]) == 0
    recording = open_recording(path)
    embedded = recording.embedded_meshes()
    hashes = recording.metadata["meshes"]
    assert {uri: hashlib.sha256(data).hexdigest() for uri, data in embedded.items()} == hashes
    assert len(hashes) > 20
    assert open_recording(log).embedded_meshes() == {}
