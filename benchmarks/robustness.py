"""How often a task succeeds when the world is not quite what it says: samples of its `vary:`.

Each sample is one `manipcli run TASK --sample N` in a process of its own, so that a crash costs one. `--hard` widens
what the pour varies, draws the gains of all controllers, and lets every motor answer a control tick late.

    python -m benchmarks.robustness
    python -m benchmarks.robustness --task tasks/pour_iiwa.yaml --hard --jobs 2
    python -m benchmarks.robustness --engine mujoco --samples 20
    python -m benchmarks.robustness --only 17 --keep runs
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from manipcli.pipeline import load_task

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 300.0
"""A sample that takes longer [s] hangs."""
HARD = """{
  scene.cup.at: {offset: {uniform: [-5 cm, 5 cm]}},
  scene.cup.mass: {uniform: [50 g, 400 g]},
  scene.cup.friction: {uniform: [0.4, 1.0]},
  controllers.*.gains.*.p: {scale: {uniform: [0.8, 1.2]}},
  controllers.*.gains.*.d: {scale: {uniform: [0.8, 1.2]}},
  robot.actuators.*.latency: {choice: [1]}}"""


def hard_overrides(task: Path) -> tuple[str, ...]:
    """As after `--set`. Joints that no transmission drives get a motor, which is what answers late."""
    robot = load_task(task).robot
    driven = {joint for tag in robot.transmissions for joint in tag.joints}
    new = [joint.name for joint in robot.moving_joints if joint.independent and joint.name not in driven]
    motors = [motor for tag in robot.transmissions for motor in tag.actuators] + [f"{name}_motor" for name in new]
    transmissions = {f"{name}_gear": {"joints": [name], "actuators": [f"{name}_motor"]} for name in new}
    return (
        *(f"robot.transmissions.{name}={json.dumps(one)}" for name, one in transmissions.items()),
        f"robot.actuators={json.dumps({motor: {'latency': 0} for motor in motors})}",
        f"vary={HARD}",
    )


@dataclass(frozen=True)
class Result:
    """What came of a sample."""

    sample: int
    passed: bool
    text: str


def run(sample: int, task: Path, folder: Path, words: tuple[str, ...], *, keep: bool) -> Result:
    """One run; its log is deleted unless it is wanted."""
    log = folder / f"{task.stem}_{sample:03d}.mcap"
    command = [sys.executable, "-m", "manipcli", "run", str(task), "--sample", str(sample), *words]
    command += ["--format", "json", "--log", str(log), "--force", "-q"]
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=PATIENCE)
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
    if told["sample"] is None:
        return f"exit code {code}: {'; '.join(error['message'] for error in told['errors'])}"
    shown = (f"{path}={_shown(value)}" for path, value in told["sample"]["values"].items() if path.startswith("scene."))
    drawn = f"{', '.join(shown)}: "
    if told["verdict"] == "passed":
        margins = (
            f"{e['name']} {e['margin']:.3g} {e['unit']}" for e in told["expectations"] if e["margin"] is not None
        )
        return f"{drawn}passed in {told['simulated_time']:.1f} s: {', '.join(margins)}"
    return f"{drawn}{told['verdict']}: {told['text']}"


def _shown(value: float | list[float]) -> str:
    return f"[{', '.join(map(_shown, value))}]" if isinstance(value, list) else f"{value:.3g}"


def wilson(passed: int, count: int) -> tuple[float, float]:
    """The 95 % confidence interval of a rate (Wilson 1927): (p + z2/2n -+ z sqrt(pq/n + z2/4n2)) / (1 + z2/n)."""
    z = 1.959964
    p, z2n = passed / count, z * z / count
    middle, half = p + z2n / 2, z * math.sqrt(p * (1 - p) / count + z2n / (4 * count))
    return (middle - half) / (1 + z2n), (middle + half) / (1 + z2n)


def main() -> int:
    """Run the samples; 0 if all passed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", type=Path, default=ROOT / "tasks" / "pour.yaml")
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seed", type=int, help="instead of the task's")
    parser.add_argument("--hard", action="store_true", help="of a task with a body named `cup`: wider ranges")
    parser.add_argument("--engine", metavar="NAME", help="instead of the task's")
    parser.add_argument("--set", dest="overrides", action="append", default=[], metavar="A.B=VALUE", help="as of `run`")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time")
    parser.add_argument("--only", type=int, metavar="N", help="run sample N alone")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep the logs there")
    chosen = parser.parse_args()

    task = chosen.task.resolve()
    words = [] if chosen.seed is None else ["--seed", str(chosen.seed)]
    engine = () if chosen.engine is None else (f"simulation.engine={chosen.engine}",)
    for override in (*engine, *(hard_overrides(task) if chosen.hard else ()), *chosen.overrides):
        words += ["--set", override]
    wanted = range(chosen.samples) if chosen.only is None else [chosen.only]
    began = time.perf_counter()
    passed = 0
    with tempfile.TemporaryDirectory(prefix="manipcli-") as scratch, ThreadPoolExecutor(chosen.jobs) as pool:
        folder = Path(scratch)
        if chosen.keep is not None:
            folder = chosen.keep.resolve()
            folder.mkdir(parents=True, exist_ok=True)
        for result in pool.map(
            lambda sample: run(sample, task, folder, tuple(words), keep=chosen.keep is not None), wanted
        ):
            passed += result.passed
            print(f"{result.sample:3d}  {result.text}", flush=True)
    low, high = wilson(passed, len(wanted))
    kind = f"{', hard' if chosen.hard else ''}{f', {chosen.engine}' if chosen.engine else ''}"
    print(
        f"{task.name}{kind}: {passed} of {len(wanted)} passed "
        f"(95 % interval {100 * low:.0f} to {100 * high:.0f} %) in {time.perf_counter() - began:.0f} s"
    )
    return 0 if passed == len(wanted) else 1


if __name__ == "__main__":
    sys.exit(main())
