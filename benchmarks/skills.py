"""How often the tasks of the skills succeed: drawer, door, peg, press, pours of twenty balls and into a mug.

Samples of each task in each engine, by `manipcli test`; each draws the `vary:` of the task, such as positions by 1 cm
either way. A line per sample that failed, then a table with Wilson's 95 % interval of the share that passes.

    python -m benchmarks.skills
    python -m benchmarks.skills --task press --engine mujoco --samples 5 --jobs 2
    python -m benchmarks.skills --write benchmarks/skills.md
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from benchmarks.processes import ROOT
from manipcli.core.units import readable
from manipcli.sweep.statistics import Rate

TASKS: Final = {"drawer": 20, "door": 20, "peg": 20, "press": 20, "granular_pour": 20, "pour_into_mug": 40}
"""Samples of each task; all are expected to pass."""
ENGINES: Final = ("pybullet", "mujoco")
LONGEST: Final = 40
"""Most lines of a task file."""
PATIENCE: Final = 3600.0
"""A sample that takes longer [s] hangs, also on a machine that is busy with other things."""
HEAD: Final = (
    "# Samples of the skills that pass\n\n"
    "Written by `python -m benchmarks.skills --write benchmarks/skills.md`.\n\n"
    "| task | lines | engine | passed | 95 % interval | least margin | median time of a run |\n"
    "|---|---|---|---|---|---|---|"
)


@dataclass(frozen=True)
class Result:
    """The samples of a task in an engine.

    Attributes:
        passed, samples: how many.
        tightest: the expectation with the least margin of all samples; "" without one.
        seconds: of a run, its median.
    """

    task: str
    engine: str
    passed: int
    samples: int
    tightest: str = ""
    seconds: float = 0.0

    @property
    def row(self) -> str:
        """Of the table."""
        low, high = Rate(self.passed, self.samples).interval
        share = f"{self.passed} of {self.samples} | {100 * low:.0f} to {100 * high:.0f} %"
        return (
            f"| {self.task} | {lines(self.task)} | {self.engine} | {share} | {self.tightest} | {self.seconds:.1f} s |"
        )


def run(task: str, engine: str, samples: int, jobs: int, folder: Path) -> Result:
    """All samples of a task in an engine; prints those that failed."""
    command = [sys.executable, "-m", "manipcli", "test", str(ROOT / "tasks" / f"{task}.yaml")]
    command += ["--samples", str(samples), "--set", f"simulation.engine={engine}", "-n", str(jobs)]
    command += ["--timeout", f"{PATIENCE:.0f} s", "--format", "json", "-q", "--logs", str(folder / task / engine)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    try:
        answer = json.loads(done.stdout)
    except json.JSONDecodeError:
        answer = {"errors": [{"message": done.stderr.strip()}]}
    cases: list[dict[str, Any]] = answer.get("cases", [])
    if not cases:
        why = "; ".join(each["message"] for each in answer["errors"])
        print(f"{task} {engine}: no sample ran: {why}", flush=True)
        return Result(task, engine, 0, samples)
    for case in cases:
        if case["outcome"] != "passed":
            print(f"{task} {engine} {case['sample']:3d}  {case['outcome']}: {case['text']}", flush=True)
    tight = [case["tightest"] for case in cases if case["tightest"] and case["outcome"] == "passed"]
    least = min(tight, key=lambda each: float(each["margin"]), default=None)
    text = "" if least is None else f"{least['name']} {readable(least['margin'], least['unit'])}"
    seconds = statistics.median(case["wall_time"] for case in cases)
    return Result(task, engine, sum(case["outcome"] == "passed" for case in cases), len(cases), text, seconds)


def main() -> int:
    """Run all samples; 0 if all pass, and no task file is too long."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", action="append", choices=TASKS, help="only this; may be repeated")
    parser.add_argument("--engine", action="append", choices=ENGINES, help="only this; may be repeated")
    parser.add_argument("--samples", type=int, help="of each task, instead of 20 or 40")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time")
    parser.add_argument("--write", type=Path, help="a file for the table")
    chosen = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory(prefix="manipcli-") as folder:
        for task in chosen.task or TASKS:
            for engine in chosen.engine or ENGINES:
                found.append(run(task, engine, chosen.samples or TASKS[task], chosen.jobs, Path(folder)))
                print(found[-1].row, flush=True)
    table = "\n".join((HEAD, *(result.row for result in found)))
    print(table)
    if chosen.write is not None:
        chosen.write.write_text(f"{table}\n")
    long = [task for task in chosen.task or TASKS if lines(task) > LONGEST]
    for task in long:
        print(f"tasks/{task}.yaml has {lines(task)} lines; expected at most {LONGEST}")
    return 0 if not long and all(result.passed == result.samples for result in found) else 1


def lines(task: str) -> int:
    """Of a task file; 0 where there is none."""
    path = ROOT / "tasks" / f"{task}.yaml"
    return len(path.read_text().splitlines()) if path.is_file() else 0


if __name__ == "__main__":
    sys.exit(main())
