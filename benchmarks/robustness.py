"""How often the pour succeeds when the world is not quite what the task says.

Each sample draws a place, a mass and a friction of the cup, and is one `manipcli run` in a process of its own, so that
a crash costs one sample. The samples follow from the seed alone; `--only K` runs one of them again.

    python benchmarks/robustness.py
    python benchmarks/robustness.py --task tasks/pour_iiwa.yaml --hard --jobs 2
    python benchmarks/robustness.py --only 17 --keep runs
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
NOMINAL_AT = (0.75, 0.0)
"""Where the tasks put the cup [m]."""
PATIENCE = 300.0
"""A sample that takes longer [s] hangs."""


@dataclass(frozen=True)
class Ranges:
    """What is drawn uniformly: the cup's place to each side [m], its mass [kg], its coefficient of friction."""

    shift: float
    mass: tuple[float, float]
    friction: tuple[float, float]


USUAL = Ranges(shift=0.02, mass=(0.05, 0.3), friction=(0.5, 1.0))
HARD = Ranges(shift=0.05, mass=(0.05, 0.4), friction=(0.4, 1.0))


@dataclass(frozen=True)
class Sample:
    """One world."""

    number: int
    at: tuple[float, float]
    mass: float
    friction: float

    @property
    def overrides(self) -> tuple[str, ...]:
        """As after `--set`."""
        return (
            f"scene.cup.at=[{self.at[0]:.6f}, {self.at[1]:.6f}]",
            f"scene.cup.mass={self.mass:.6f}",
            f"scene.cup.friction={self.friction:.6f}",
        )

    def __str__(self) -> str:
        x, y = (1000 * (p - n) for p, n in zip(self.at, NOMINAL_AT, strict=True))
        return f"{self.number:3d}  x {x:+6.1f} mm  y {y:+6.1f} mm  {1000 * self.mass:5.0f} g  mu {self.friction:.2f}"


@dataclass(frozen=True)
class Result:
    """What came of a sample."""

    sample: Sample
    passed: bool
    text: str


def samples(count: int, seed: int, ranges: Ranges) -> Iterator[Sample]:
    """The first `count` of the endless sequence of a seed; a longer one begins with the shorter."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        dx, dy = rng.uniform(-ranges.shift, ranges.shift, 2)
        yield Sample(
            number,
            at=(NOMINAL_AT[0] + float(dx), NOMINAL_AT[1] + float(dy)),
            mass=float(rng.uniform(*ranges.mass)),
            friction=float(rng.uniform(*ranges.friction)),
        )


def run(sample: Sample, task: Path, folder: Path, *, keep: bool) -> Result:
    """One run; its log is deleted unless it is wanted."""
    log = folder / f"{task.stem}_{sample.number:03d}.mcap"
    words = [sys.executable, "-m", "manipcli", "run", str(task), "--format", "json", "--log", str(log), "--force", "-q"]
    for override in sample.overrides:
        words += ["--set", override]
    try:
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return Result(sample, False, f"hangs: no end after {PATIENCE:.0f} s")
    finally:
        if not keep:
            log.unlink(missing_ok=True)
    return Result(sample, done.returncode == 0, _told(done.returncode, done.stdout, done.stderr))


def _told(code: int, out: str, err: str) -> str:
    """The outcome in a line: the margins that were left, or the cause."""
    try:
        told = json.loads(out)
    except json.JSONDecodeError:
        return f"exit code {code}: {err.strip()[-300:]}"
    if told["verdict"] == "passed":
        margins = (
            f"{e['name']} {e['margin']:.3g} {e['unit']}" for e in told["expectations"] if e["margin"] is not None
        )
        return f"passed in {told['simulated_time']:.1f} s: {', '.join(margins)}"
    causes = [f"{step['id']} {step['outcome']}: {step['text']}" for step in told["steps"]
              if step["outcome"] not in ("done", "not_run")]  # fmt: skip
    causes += [f"{e['name']} {e['outcome']}: {e['text']}" for e in told["expectations"] if e["outcome"] != "passed"]
    causes += [error["message"] for error in told["errors"]]
    return f"{told['verdict']}: {'; '.join(causes) or told['text']}"


def wilson(passed: int, count: int) -> tuple[float, float]:
    """The 95 % confidence interval of a rate (Wilson 1927): (p + z2/2n -+ z sqrt(pq/n + z2/4n2)) / (1 + z2/n)."""
    z = 1.959964
    p, z2n = passed / count, z * z / count
    middle, half = p + z2n / 2, z * math.sqrt(p * (1 - p) / count + z2n / (4 * count))
    return (middle - half) / (1 + z2n), (middle + half) / (1 + z2n)


def main() -> int:
    """Run the samples; 0 if all passed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", type=Path, default=ROOT / "tasks" / "pour.yaml", help="with a body named `cup`")
    parser.add_argument("--samples", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--hard", action="store_true", help="within 5 cm, 50 to 400 g, friction 0.4 to 1.0")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time")
    parser.add_argument("--only", type=int, metavar="K", help="run sample K alone")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep the logs there")
    chosen = parser.parse_args()

    ranges = HARD if chosen.hard else USUAL
    wanted = [s for s in samples(max(chosen.samples, (chosen.only or 0) + 1), chosen.seed, ranges)
              if chosen.only in (None, s.number)]  # fmt: skip
    task = chosen.task.resolve()
    began = time.perf_counter()
    passed = 0
    with tempfile.TemporaryDirectory(prefix="manipcli-") as scratch, ThreadPoolExecutor(chosen.jobs) as pool:
        folder = Path(scratch)
        if chosen.keep is not None:
            folder = chosen.keep.resolve()
            folder.mkdir(parents=True, exist_ok=True)
        for result in pool.map(lambda sample: run(sample, task, folder, keep=chosen.keep is not None), wanted):
            passed += result.passed
            print(f"{result.sample}  {result.text}", flush=True)
    low, high = wilson(passed, len(wanted))
    print(
        f"{task.name}{', hard ranges' if chosen.hard else ''}, seed {chosen.seed}: {passed} of {len(wanted)} passed "
        f"(95 % interval {100 * low:.0f} to {100 * high:.0f} %) in {time.perf_counter() - began:.0f} s"
    )
    return 0 if passed == len(wanted) else 1


if __name__ == "__main__":
    sys.exit(main())
