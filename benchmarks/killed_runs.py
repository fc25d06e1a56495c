"""What is left of runs that are killed at random moments: always a readable log, at most a simulated second short.

Each run is a process of its own that reports through shared memory which tick it has recorded. After SIGKILL the file
it leaves is opened, judged and repaired; the repaired file must pass the mcap library's reader with all checksums.

    python -m benchmarks.killed_runs
    python -m benchmarks.killed_runs --runs 5 --seed 3 --task tasks/pick_place.yaml
"""

from __future__ import annotations

import argparse
import mmap
import random
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from mcap.reader import make_reader

from benchmarks.table import Row, markdown
from manipcli.pipeline import judge_log
from manipcli.record.foreign.repair import repair
from manipcli.record.read.reading import read_recording

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = 1.0
"""[s] of simulated time that may be lost."""
PATIENCE = 120.0
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


@dataclass(frozen=True)
class Killed:
    """A run that was killed: simulated seconds recorded until then, and those of them that are in the file."""

    recorded: float
    kept: float

    @property
    def lost(self) -> float:
        return self.recorded - self.kept


def killed_run(task: Path, folder: Path, delay: float) -> Killed | None:
    """Kill a run `delay` [s] after its first tick; None where it was over before.

    Raises:
        AssertionError: what it left is not as it should be.
    """
    log, shared = folder / "run.mcap", folder / "ticks"
    shared.write_bytes(bytes(8))
    process = subprocess.Popen([sys.executable, "-c", CHILD, str(task), str(log), str(shared)], cwd=ROOT)
    with shared.open("rb") as file, mmap.mmap(file.fileno(), 8, access=mmap.ACCESS_READ) as memory:

        def ticks() -> int:
            return int(struct.unpack_from("<q", memory, 0)[0])

        gives_up = time.monotonic() + PATIENCE
        while ticks() == 0 and process.poll() is None and time.monotonic() < gives_up:
            time.sleep(0.001)
        time.sleep(delay)
        process.kill()
        if process.wait() == 0:
            log.unlink()
            return None
        recorded = ticks()
    partial = log.with_name("run.mcap.partial")
    assert not log.exists(), "a run that was killed has no finished log"
    recording = read_recording(partial)
    assert recording.lost is not None
    assert judge_log(partial).verdict == "error"
    clean = folder / "clean.mcap"
    done = repair(partial, clean, overwrite=True)
    with clean.open("rb") as opened:
        reader = make_reader(opened, validate_crcs=True)
        assert sum(1 for _ in reader.iter_messages()) == done.messages
    kept = len(recording.states.time)
    period = recording.period
    return Killed(recorded=recorded * period, kept=kept * period)


def main() -> int:
    """Kill, look, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--task", type=Path, default=ROOT / "tasks" / "pour.yaml")
    options = parser.parse_args()
    moments = random.Random(options.seed)
    killed: list[Killed] = []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        while len(killed) < options.runs:
            one = killed_run(options.task, Path(name), moments.uniform(0.0, 2.5))
            if one is not None:
                killed.append(one)
                print(f"killed after {one.recorded:.3f} s: {one.lost:.3f} s lost", flush=True)
    row = Row("simulated time lost by a kill", tuple(one.lost for one in killed), "s", ALLOWED, f"{len(killed)} runs")
    print(markdown([row]))
    return 0 if all(one.lost <= ALLOWED for one in killed) else 1


if __name__ == "__main__":
    sys.exit(main())
