"""Margins of every shipped task and example in both engines, from `manipcli run TASK --engines ... --format json`."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from benchmarks.engines.worlds import NAMES
from benchmarks.processes import ENVIRONMENT, MANIPCLI, ROOT
from manipcli.core.units import readable

SHOWN: Final = {"margin": "", "duration": "duration", "slip": "slip in the hand", "grasp_force": "peak grip force"}
"""Kinds of numbers on the page, and how they are called there."""


def shipped() -> list[Path]:
    """Task files of tasks/ and examples/."""
    return [*sorted(ROOT.glob("tasks/*.yaml")), *sorted(ROOT.glob("examples/*/task.yaml"))]


def task_rows() -> tuple[list[tuple[str, ...]], str]:
    """One row per number, with the task in its first; and how many tasks agree."""
    rows, agree, tasks = [], [], shipped()
    for task in tasks:
        compared = compare(task)
        print(f"{task.relative_to(ROOT)}: {compared['text']}", file=sys.stderr)
        agree.append(bool(compared["agrees"]))
        head = f"[{task.relative_to(ROOT)}](../{task.relative_to(ROOT)})"
        rows.append((head, "verdict", *(run["verdict"] for run in compared["runs"])))
        rows += [("", *row) for row in _numbers(compared)]
    return (
        rows,
        f"{sum(agree)} of {len(tasks)} agree: the same verdict, and the same outcome of each step and expectation.",
    )


def compare(task: Path) -> dict[str, Any]:
    """The JSON of the comparison.

    Raises:
        RuntimeError: there is none.
    """
    with TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        words = ["run", str(task), "--engines", ",".join(NAMES), "--format", "json", "-q", "--force"]
        words += ["--log", str(Path(folder) / "run.mcap")]
        command = [sys.executable, "-c", MANIPCLI, *words]
        done = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    told: dict[str, Any] = json.loads(done.stdout) if done.stdout.strip() else {}
    if "numbers" not in told:
        raise RuntimeError(f"{task}: exit code {done.returncode}: {done.stderr[-500:]}")
    return told


def _numbers(compared: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for number in compared["numbers"]:
        if number["kind"] not in SHOWN:
            continue
        if number["kind"] == "margin" and not any(number["values"]) and len(set(number["outcomes"])) == 1:
            continue  # no contact, in both
        name, kind = number["name"], SHOWN[number["kind"]]
        what = f"`{name}`" if not kind else f"{kind}, `{name}`" if name else kind
        outcomes = number["outcomes"] or ["passed"] * len(number["values"])
        yield what, *(_cell(*each, number["unit"]) for each in zip(number["values"], outcomes, strict=True))


def _cell(value: float | None, outcome: str, unit: str) -> str:
    text = "-" if value is None else readable(value, unit)
    return text if outcome == "passed" else f"{text}, {outcome}"
