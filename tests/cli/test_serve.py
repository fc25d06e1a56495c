"""`manipcli serve` and `manipcli topic`: the address on stdout, one message that moves the arm, ends and refusals."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from manipcli import pipeline
from manipcli.cli.app import main
from manipcli.judge.steps import STEPS_ENDED
from manipcli.judge.verdict import Verdict
from manipcli.record.read.reading import read_recording
from manipcli.report.run_report import RunReport, Timing
from tests.conftest import RunCli
from tests.live.sessions import ROOT, SMALL

WATCHED = ("/clock", "/joint_states", "/tf", "/arm_controller/controller_state", "/task/events")
TOPIC, TYPE = "/arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory"
MESSAGE = (
    "{joint_names: [joint_1, joint_2, joint_3, joint_4, joint_5, joint_6, joint_7], "
    "points: [{positions: [0.1, 0.1, 0, -1.6, 0, -0.1, 0], time_from_start: {sec: 0, nanosec: 500000000}}]}"
)


def test_a_published_message_moves_the_arm_and_a_signal_ends_the_session_well(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    command = [sys.executable, "-m", "manipcli", "serve", "small.yaml", "--port", "0", "--speed", "max"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url.startswith("ws://127.0.0.1:")
        assert main(["topic", "list", "--url", url]) == 0
        assert TOPIC in capfd.readouterr().out
        assert main(["topic", "pub", "--once", TOPIC, TYPE, MESSAGE, "--url", url]) == 0
        reader = url.partition("?")[0]
        assert main(["topic", "pub", "--once", TOPIC, TYPE, MESSAGE, "--url", reader]) == 1
        assert "may only read" in capfd.readouterr().err
        process.send_signal(signal.SIGTERM)
        out, told = process.communicate(timeout=60)
    assert process.returncode == 0, told
    assert "session ended" in out
    assert "Traceback" not in told
    states = read_recording(tmp_path / "runs/small@live.mcap").states
    assert states.position[0, 0] == pytest.approx(0.0, abs=0.01)
    assert states.position[:, 0].max() > 0.001


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["--speed", "fast"], "USE130"),
        (["--speed", "0"], "USE130"),
        (["--open", "--host", "0.0.0.0"], "USE133"),
        (["--token-file", "short"], "USE134"),
        (["--host", ""], "USE131"),
        (["--host", "no.such.host.invalid"], "USE131"),
    ],
)
def test_bad_options_are_refused(words: list[str], code: str, call_cli: RunCli, tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    (tmp_path / "short").write_text("12345\n")
    ran = call_cli("serve", "small.yaml", *words, cwd=tmp_path)
    assert (ran.code, code in ran.err) == (4, True), ran.err


@pytest.mark.slow
def test_a_pick_passes_while_three_clients_watch(tmp_path: Path) -> None:
    task = ROOT / "examples/02_pick_a_block/task.yaml"
    options = ["--run", "--port=0", "--no-page", "--no-foxglove", "--speed=max", "--log=pick.mcap"]
    got: list[set[str]] = [set(), set(), set()]

    def watch(url: str, topics: set[str]) -> None:
        with connect(url, max_size=None) as client:
            for topic in WATCHED:
                client.send(json.dumps({"op": "subscribe", "topic": topic}))
            with suppress(ConnectionClosed):
                for frame in client:
                    message = json.loads(frame)
                    topics.add(message["topic"])
                    if message["topic"] == "/task/events" and message["msg"].get("kind") == STEPS_ENDED:
                        over.set()

    over = threading.Event()
    with subprocess.Popen(
        [sys.executable, "-m", "manipcli", "serve", str(task), *options], stdout=subprocess.PIPE, text=True,
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        watchers = [threading.Thread(target=watch, args=(url, topics)) for topics in got]
        for watcher in watchers:
            watcher.start()
        ended = over.wait(100)
        process.send_signal(signal.SIGTERM)
        out, _ = process.communicate(timeout=60)
        for watcher in watchers:
            watcher.join(10)
    assert ended
    assert (process.returncode, "pick_a_block passed" in out) == (0, True), out
    assert got == [set(WATCHED)] * 3


@pytest.mark.parametrize("words", [[], ["--run"]])
def test_a_lost_network_fails_a_session_whose_steps_passed(
    words: list[str], call_cli: RunCli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    why = "the process of the network was ended by signal 9"
    report = RunReport(Verdict("small", "passed", 1, "pybullet", 1.0, (), ()), Timing(simulate=1.0), log="a.mcap")
    monkeypatch.setattr(pipeline, "serve_task", lambda *_, **__: (report, why))
    (tmp_path / "small.yaml").write_text(SMALL)
    ran = call_cli("serve", "small.yaml", *words, cwd=tmp_path)
    assert (ran.code, ran.out.count(why)) == (1, 1)


def test_a_port_in_use_is_named_and_leaves_no_log(call_cli: RunCli, tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(SMALL)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ran = call_cli("serve", "small.yaml", "--port", port, "--log", "a.mcap", cwd=tmp_path)
    assert (ran.code, f"port {port} of 127.0.0.1 is already in use" in ran.err) == (4, True)
    assert [*tmp_path.glob("a.mcap*")] == []
