"""Law: a run with compiled kernels writes the log, byte by byte, of the run without them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manipcli.pipeline import run_task

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("task", ["tasks/home.yaml", pytest.param("tasks/pour.yaml", marks=pytest.mark.slow)])
def test_a_run_writes_the_same_log(task: str, watched: Any, using: Any, tmp_path: Path) -> None:
    logs = []
    for name, used in (("compiled", watched), ("python", None)):
        path = tmp_path / f"{name}.mcap"
        with using(used):
            report = run_task(ROOT / task, log=path)
        assert report.verdict.verdict == "passed"
        logs.append(path.read_bytes())
    assert logs[0] == logs[1]
    assert watched.bound >= {"errors", "pid", "sample", "copies", "model_efforts", "window", "rows"}
