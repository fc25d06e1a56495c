"""A run that is killed, or whose disk is full, leaves a log that is at most a simulated second short, and no other."""

from __future__ import annotations

import json
import mmap
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mcap.reader import make_reader

from manipcli.pipeline import judge_log
from manipcli.record.foreign.repair import repair
from manipcli.record.read.reading import read_recording

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow
CHILD = """
import mmap, struct, sys
from pathlib import Path
from manipcli.pipeline import run_task
from manipcli.record.write.recorder import Recorder
task, log, shared = map(Path, sys.argv[1:])
file = shared.open("r+b")
memory = mmap.mmap(file.fileno(), 8)
record = Recorder.tick
def tick(self, number, state, outputs):
    record(self, number, state, outputs)
    struct.pack_into("<q", memory, 0, number + 1)
Recorder.tick = tick
run_task(task, log=log, force=True)
"""


@pytest.mark.parametrize("after", [1, 1500])
def test_a_kill_costs_at_most_a_second_and_never_the_log_before(tmp_path: Path, after: int) -> None:
    log, shared = tmp_path / "run.mcap", tmp_path / "ticks"
    log.write_bytes(b"the log of an earlier run")
    shared.write_bytes(bytes(8))
    command = [sys.executable, "-c", CHILD, str(ROOT / "tasks" / "pour.yaml"), str(log), str(shared)]
    process = subprocess.Popen(command, cwd=ROOT)
    with shared.open("rb") as file, mmap.mmap(file.fileno(), 8, access=mmap.ACCESS_READ) as memory:
        deadline = time.monotonic() + 600.0
        while struct.unpack_from("<q", memory, 0)[0] < after:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.0005)
        process.kill()
        process.wait()
        recorded = struct.unpack_from("<q", memory, 0)[0]
    assert log.read_bytes() == b"the log of an earlier run"
    partial = tmp_path / "run.mcap.partial"
    recording = read_recording(partial)
    assert recorded - len(recording.states.time) <= 1000
    assert recording.lost is not None
    assert judge_log(partial).verdict == "error"
    done = repair(partial, tmp_path / "clean.mcap")
    with (tmp_path / "clean.mcap").open("rb") as opened:
        assert sum(1 for _ in make_reader(opened, validate_crcs=True).iter_messages()) == done.messages
    assert judge_log(tmp_path / "clean.mcap").verdict == "error"


def test_a_file_that_may_not_grow_keeps_what_is_in_it_and_the_log_before(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    log.write_bytes(b"the log of an earlier run")
    words = f"{sys.executable} -m manipcli run {ROOT}/tasks/pour.yaml --log {log} --force --format json"
    done = subprocess.run(
        ["bash", "-c", f"ulimit -f 3000; exec {words}"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 3, done.stderr
    answer = json.loads(done.stdout)
    assert "recording stopped at t = " in answer["errors"][0]["message"]
    known = {"task": "pour", "seed": 1, "engine": "pybullet", "log": f"{log}.partial"}
    assert {key: answer[key] for key in known} == known
    assert "Traceback" not in done.stderr
    assert log.read_bytes() == b"the log of an earlier run"
    partial = tmp_path / "run.mcap.partial"
    assert partial.stat().st_size <= 3_000 * 1024
    assert len(read_recording(partial).states.time) >= 1000
    assert judge_log(partial).verdict == "error"
