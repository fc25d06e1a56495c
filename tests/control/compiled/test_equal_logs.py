"""Law: a run with compiled kernels writes the log, byte by byte, of the run without them, and of another process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manipcli.pipeline import run_task, verify_log

ROOT = Path(__file__).resolve().parents[3]
LAWS = {"errors", "pid", "sample", "copies", "model_efforts", "window", "rows"}


def test_a_run_writes_the_same_log(watched: Any, using: Any, tmp_path: Path) -> None:
    logs = []
    for name, used in (("compiled", watched), ("python", None)):
        path = tmp_path / f"{name}.mcap"
        with using(used):
            report = run_task(ROOT / "tasks/home.yaml", log=path)
        assert report.verdict.verdict == "passed"
        logs.append(path.read_bytes())
    assert logs[0] == logs[1]
    assert watched.bound >= LAWS


@pytest.mark.slow
def test_the_pour_of_another_process_has_the_same_bytes(
    pour_run: Any, watched: Any, using: Any, call_cli: Any, tmp_path: Path
) -> None:
    """Also from another working directory, to a log of another name, and simulated without kernels from its log."""
    again = tmp_path / "again.mcap"
    with using(watched):
        ran = call_cli("run", ROOT / "tasks/pour.yaml", "-q", "--log", again, cwd=tmp_path)
    assert (ran.code, ran.err) == (0, "")
    assert again.read_bytes() == pour_run.log.read_bytes()
    assert watched.bound >= LAWS
    with using(None):
        assert verify_log(pour_run.log, package_path=[ROOT / "robots"]).identical
