"""One pour for the whole test session: several tests look at the same run."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Ran:
    """A command line that came to its end."""

    code: int
    out: str
    err: str


RunCli = Callable[..., Ran]


@pytest.fixture(scope="session")
def run_cli() -> RunCli:
    """Calls the command line in a process of its own, as a user does."""

    def run(*words: str | Path, cwd: Path, timeout: float = 120.0, **options: object) -> Ran:
        done = subprocess.run(
            [sys.executable, "-m", "manipcli", *map(str, words)],
            cwd=cwd,
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout,
            **options,  # type: ignore[call-overload]
        )
        return Ran(done.returncode, done.stdout, done.stderr)

    return run


@dataclass(frozen=True)
class PourRun:
    """`ran`: `manipcli run tasks/pour.yaml --format json`; `log`: where it recorded."""

    ran: Ran
    log: Path


@pytest.fixture(scope="session")
def pour_run(run_cli: RunCli, tmp_path_factory: pytest.TempPathFactory) -> PourRun:
    """The pour, run once."""
    folder = tmp_path_factory.mktemp("pour")
    ran = run_cli("run", ROOT / "tasks" / "pour.yaml", "--format", "json", cwd=folder)
    return PourRun(ran, folder / "runs" / "pour.mcap")
