"""The command as a person and a shell meet it: a terminal, pipes that close, signals, odd environments."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from manipcli.record.read.reading import read_recording

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
MANIPCLI = [sys.executable, "-m", "manipcli"]
HOME = ROOT / "tasks" / "home.yaml"
LONG = f"""\
task: long
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
steps:
  - wait: 1 s
  - wait: 1000 s
"""


@pytest.fixture
def nod(tmp_path: Path) -> Path:
    """As short as a run can be."""
    path = tmp_path / "nod.yaml"
    path.write_text(
        f"task: nod\nrobot: {ROOT}/robots/differential_wrist/robot.yaml\n"
        f"controllers: {ROOT}/controllers/differential_wrist.yaml\n"
        "simulation: {engine: kinematic, settle: 0 s}\nsteps: [{wait: 0.1 s}]\n"
    )
    return path


@pytest.fixture
def long_task(tmp_path: Path) -> Path:
    path = tmp_path / "long.yaml"
    path.write_text(LONG)
    return path


def on_a_terminal(*words: object, cwd: Path, **environment: str) -> tuple[int, str]:
    """Exit code, and everything that a terminal was sent."""
    child, parent = pty.openpty()
    process = subprocess.Popen(
        [*MANIPCLI, *map(str, words)], cwd=cwd, stdin=parent, stdout=parent, stderr=parent,
        env={**os.environ, "TERM": "xterm-256color", **environment},
    )  # fmt: skip
    os.close(parent)
    seen = b""
    while True:
        try:
            more = os.read(child, 65536)
        except OSError:  # how Linux says that the other side is closed
            break
        if not more:
            break
        seen += more
    os.close(child)
    return process.wait(60), seen.decode()


def test_a_terminal_gets_a_live_line_and_colour_and_the_result_last(tmp_path: Path) -> None:
    code, seen = on_a_terminal("run", HOME, cwd=tmp_path)
    assert code == 0
    assert seen.count("\r\x1b[K") > 3
    assert "[1/1] follow_1" in seen
    assert "x real time" in seen
    assert "\x1b[32m✓\x1b[0m home passed" in seen
    assert "pybullet build time" not in seen
    last = seen.rsplit("\x1b[K", 1)[1]
    assert last.startswith("step ")


@pytest.mark.parametrize("environment", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_who_wants_no_colour_gets_none(nod: Path, environment: dict[str, str]) -> None:
    code, seen = on_a_terminal("run", nod, cwd=nod.parent, **environment)
    assert code == 0
    assert "\x1b[3" not in seen
    assert "✓ nod passed" in seen


def test_a_narrow_terminal_is_not_wrapped(tmp_path: Path) -> None:
    script = f"stty cols 20; exec {' '.join(MANIPCLI)} run {HOME}"
    child, parent = pty.openpty()
    process = subprocess.Popen(["bash", "-c", script], cwd=tmp_path, stdin=parent, stdout=parent, stderr=parent)
    os.close(parent)
    seen = b""
    while select.select([child], [], [], 30)[0]:
        try:
            seen += os.read(child, 65536)
        except OSError:
            break
    os.close(child)
    assert process.wait(60) == 0
    live = [part.split("\r")[0] for part in seen.decode().split("\x1b[K")[1:-1]]
    assert live
    assert max(map(len, live)) < 20


def test_a_reader_that_leaves_early_changes_nothing(nod: Path) -> None:
    script = f"set -o pipefail; {' '.join(MANIPCLI)} run {nod} | head -1"
    done = subprocess.run(["bash", "-c", script], cwd=nod.parent, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.count("\n")) == (0, 1)
    assert "Traceback" not in done.stderr
    assert "Broken" not in done.stderr
    assert (nod.parent / "runs" / "nod.mcap").is_file()


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_no_fault(nod: Path, closed: str) -> None:
    done = subprocess.run(
        ["bash", "-c", f"{' '.join(MANIPCLI)} run {nod} {closed}"],
        cwd=nod.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert (nod.parent / "runs" / "nod.mcap").read_bytes().endswith(b"\x89MCAP0\r\n")


def test_a_terminal_without_unicode_gets_escapes(nod: Path) -> None:
    environment = {**os.environ, "LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run([*MANIPCLI, "run", nod], cwd=nod.parent, capture_output=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    done.stdout.decode("ascii")
    assert b"nod passed" in done.stdout


def begin(task: Path, *words: str, **options: Any) -> subprocess.Popen[str]:
    """A run in the background; returns when its first step is done, which it says on stderr."""
    process = subprocess.Popen(
        [*MANIPCLI, "run", str(task), *words], cwd=task.parent, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, **options,
    )  # fmt: skip
    assert process.stderr is not None
    lines = iter(process.stderr.readline, "")
    line = next((line for line in lines if not line.startswith("planning step")), "")
    assert "wait_1: done" in line, line
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_run_with_a_whole_log(long_task: Path, number: signal.Signals) -> None:
    if signal.getsignal(number) is signal.SIG_IGN:
        pytest.skip("who started the tests has it ignored, as `nohup` does")
    process = begin(long_task, "--format", "json")
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 2
    assert "Traceback" not in err
    answer = json.loads(out)
    assert answer["verdict"] == "error"
    assert [error["code"] for error in answer["errors"]] == ["RUN101"]
    assert answer["steps"][0]["outcome"] == "done"
    assert answer["steps"][1]["outcome"] in ("interrupted", "not_run")  # not_run: it came just between the two
    recording = read_recording(long_task.parent / "runs" / "long.mcap")
    assert recording.lost is None
    assert recording.states.time[-1] >= 0.99
    judged = subprocess.run(
        [*MANIPCLI, "judge", "runs/long.mcap"], cwd=long_task.parent, capture_output=True, check=False
    )
    assert judged.returncode == 2


def test_ctrl_c_is_heard_also_where_it_was_inherited_as_ignored(long_task: Path) -> None:
    """As by a command that a shell without job control starts in the background."""
    process = begin(long_task, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=120)
    assert process.returncode == 2


def test_nohup_keeps_its_word(long_task: Path) -> None:
    process = begin(long_task, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    process.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.0)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=120)
    assert process.returncode == 2


def test_a_signal_while_the_program_starts_is_2_as_well(long_task: Path) -> None:
    """At any moment of loading, planning and running; before the interpreter listens the signal itself ends it."""
    for delay in (0.15, 0.3, 0.45, 0.6):
        process = subprocess.Popen(
            [*MANIPCLI, "run", str(long_task)], cwd=long_task.parent, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )  # fmt: skip
        time.sleep(delay)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=120)
        assert process.returncode in (2, -signal.SIGTERM), err
        if process.returncode == 2:
            assert "Traceback" not in err


def test_a_signal_while_the_commands_are_imported_is_2_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\n"
        "class Finder:\n    @staticmethod\n    def find_spec(name, *_):\n"
        "        if name == 'typer': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Finder)\n"
    )
    paths = os.pathsep.join([str(tmp_path), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": paths}
    ran = subprocess.run([*MANIPCLI, "list"], env=environment, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (2, "error[USE002]: interrupted\n")


def test_a_signal_while_a_text_is_executed_is_2_as_well(nod: Path, tmp_path: Path) -> None:
    """As by the definition of a dataclass: CPython remembers it, whoever catches it, until the next text."""
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\nimport manipcli.report.json, manipcli.report.text\n"
        "class Finder:\n    @staticmethod\n    def find_spec(name, *_):\n"
        "        if name == 'manipcli.task.load_task': exec('raise KeyboardInterrupt')\n"
        "sys.meta_path.insert(0, Finder)\n"
    )
    paths = os.pathsep.join([str(tmp_path), str(ROOT)])
    ran = subprocess.run(
        [*MANIPCLI, "run", str(nod)], env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (ran.returncode, ran.stderr) == (2, "error[USE002]: interrupted\n")


def test_what_a_killed_run_leaves_is_readable(long_task: Path, nod: Path) -> None:
    process = begin(long_task)
    time.sleep(0.3)
    process.kill()
    process.wait(10)
    folder = long_task.parent / "runs"
    assert not (folder / "long.mcap").exists()
    recording = read_recording(folder / "long.mcap.partial")
    assert recording.lost is not None
    assert recording.states.time[-1] >= 0.9
    judged = subprocess.run(
        [*MANIPCLI, "judge", "long.mcap.partial"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert judged.returncode == 3
    assert "incomplete" in judged.stdout
    again = subprocess.run([*MANIPCLI, "run", nod, "-q"], cwd=long_task.parent, capture_output=True, check=False)
    assert again.returncode == 0


def test_a_full_disk_is_told_and_what_was_recorded_stays(long_task: Path) -> None:
    """A limit on the size of files stands for it: the write fails in the same way."""
    script = f"ulimit -f 400; exec {' '.join(MANIPCLI)} run {long_task}"  # 400 kB
    done = subprocess.run(
        ["bash", "-c", script], cwd=long_task.parent, capture_output=True, text=True, check=False, timeout=100
    )
    assert done.returncode == 3, done
    assert "LOG200" in done.stderr
    assert "Traceback" not in done.stderr
    assert read_recording(long_task.parent / "runs" / "long.mcap.partial").states.time.size > 0
