"""How often the pour succeeds when the robot knows only roughly where the cup is, with and without `locate`.

Samples of tasks/pour_seen.yaml, the same without its `locate`, and of tasks/pour_handle.yaml; each is one `manipcli run
TASK --sample N` in a process of its own. A line per sample; then the passes, McNemar's exact test of the pairs with and
without `locate`, and the location errors.

    python -m benchmarks.pour_seen
    python -m benchmarks.pour_seen --samples 10 --jobs 2
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.processes import ROOT
from manipcli.sweep.statistics import Rate

PATIENCE: Final = 3600.0
"""A sample that takes longer [s] hangs, also on a machine that is busy with other things."""
TASKS: Final = ROOT / "tasks"
BLIND: Final = ("--set", "steps.0={wait: 0.1 s}")
"""In place of `locate`."""
KINDS: Final = {"with locate": ("pour_seen", ()), "without locate": ("pour_seen", BLIND), "handle": ("pour_handle", ())}
MEDIAN, MOST = 3e-3, 8e-3
"""[m] Aims of the location error: median, and 95 % quantile."""


@dataclass(frozen=True)
class Sample:
    """One run: whether it passed, the errors [m] and [rad] of what was located, and its outcome in a line."""

    passed: bool
    position: tuple[float, ...]
    rotation: tuple[float, ...]
    text: str


def run(task: str, words: Sequence[str], folder: Path, number: int) -> Sample:
    """One sample."""
    command = [sys.executable, "-m", "manipcli", "run", str(TASKS / f"{task}.yaml"), "--sample", str(number), *words]
    command += ["--format", "json", "--log", str(folder / f"{number}.mcap"), "--force", "-q"]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=PATIENCE)
        found = json.loads(done.stdout)
    except (subprocess.TimeoutExpired, json.JSONDecodeError) as error:
        return Sample(False, (), (), f"{type(error).__name__}: {error}")
    after = [each["after"] for each in found["located"] if each["after"] is not None]
    position, rotation = (tuple(each[key] for each in after) for key in ("position", "rotation"))
    errors = "".join(
        f", off by {1e3 * p:.2f} mm and {math.degrees(r):.1f} deg" for p, r in zip(position, rotation, strict=True)
    )
    why = "" if done.returncode == 0 else f": {found['text'] or '; '.join(each['message'] for each in found['errors'])}"
    return Sample(done.returncode == 0, position, rotation, f"{found['verdict']}{errors}{why}")


def mcnemar(only_first: int, only_second: int) -> float:
    """Two-sided exact p of McNemar's test: of `n` discordant pairs, as uneven a split of fair coins."""
    n, least = only_first + only_second, min(only_first, only_second)
    return min(1.0, 2.0 * sum(math.comb(n, k) for k in range(least + 1)) / 2.0**n)


def main() -> int:
    """Run all samples; 0 if the aims are met."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=60)
    parser.add_argument("--kind", action="append", choices=KINDS, help="only this; may be repeated")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time")
    chosen = parser.parse_args()
    found: dict[str, list[Sample]] = {}
    for kind in chosen.kind or KINDS:
        task, words = KINDS[kind]
        found[kind] = []
        with tempfile.TemporaryDirectory(prefix="manipcli-") as folder, ThreadPoolExecutor(chosen.jobs) as pool:
            for number, sample in enumerate(pool.map(partial(run, task, words, Path(folder)), range(chosen.samples))):
                found[kind].append(sample)
                print(f"{kind} {number:3d}  {sample.text}", flush=True)
    good = True
    for kind, samples in found.items():
        passed = sum(sample.passed for sample in samples)
        low, high = Rate(passed, len(samples)).interval
        print(f"{kind}: {passed} of {len(samples)} passed (95 % interval {100 * low:.0f} to {100 * high:.0f} %)")
        errors = np.array([error for sample in samples for error in sample.position])
        if len(errors):
            median, most = np.median(errors), np.quantile(errors, 0.95)
            turned = np.degrees(np.quantile([error for sample in samples for error in sample.rotation], 0.95))
            print(f"  off by {1e3 * median:.2f} mm (median), {1e3 * most:.2f} mm and {turned:.1f} deg (95 %)")
            good &= passed == len(samples) and median <= MEDIAN and most <= MOST
    if len({"with locate", "without locate"} & found.keys()) == 2:
        good &= better(found["with locate"], found["without locate"])
    return 0 if good else 1


def better(seen: Sequence[Sample], blind: Sequence[Sample]) -> bool:
    """Whether significantly more of the same samples pass with `locate`."""
    only_seen = sum(one.passed and not other.passed for one, other in zip(seen, blind, strict=True))
    only_blind = sum(other.passed and not one.passed for one, other in zip(seen, blind, strict=True))
    p = mcnemar(only_seen, only_blind)
    print(f"only with locate: {only_seen} samples, only without: {only_blind}; McNemar's exact test: p = {p:.2g}")
    return only_seen > only_blind and p < 0.01


if __name__ == "__main__":
    sys.exit(main())
