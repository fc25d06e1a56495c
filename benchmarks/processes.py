"""What is measured of whole processes: the command against its parts, the help, memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.table import Row

ROOT = Path(__file__).resolve().parents[1]
POUR = ROOT / "tasks" / "pour.yaml"
MEGABYTE = 1e6
MANIPCLI = "import sys; from manipcli.cli.app import main; sys.exit(main())"
PEAK = """
import sys
text = open("/proc/self/status").read()
print("peak", text.split("VmHWM:")[1].split()[0], file=sys.stderr)
"""
"""Kibibytes. What `getrusage` calls the peak counts the parent's, too, from before the new program was loaded."""
CACHE = tempfile.TemporaryDirectory(prefix="manipcli-benchmark-cache-")
ENVIRONMENT = os.environ | {"PYTHONPYCACHEPREFIX": CACHE.name, "PYTHONDONTWRITEBYTECODE": ""}
LIBRARIES = """
import sys, sysconfig
from pathlib import Path
from manipcli.pipeline import run_task
run_task(Path(sys.argv[1]), log=Path(sys.argv[2]), force=True)
places = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
for name, module in list(sys.modules.items()):
    file = getattr(module, "__file__", None) or ""
    if name != "__main__" and not name.startswith("manipcli") and any(file.startswith(p) for p in places):
        print(name)
"""
"""Prints every module of other people's that a run has imported."""


@dataclass(frozen=True)
class Ran:
    """A finished process: its wall time [s], the peak of its memory [bytes], what it wrote to stdout."""

    wall: float
    peak: float
    out: str


def run(code: str, arguments: Sequence[str] = ()) -> Ran:
    """Run Python code in a process of its own, which must succeed; compiled modules are kept as in an installation.

    Raises:
        RuntimeError: it did not; its stderr.
    """
    command = [sys.executable, "-c", f"import atexit\natexit.register(lambda: exec({PEAK!r}))\n{code}", *arguments]
    began = time.perf_counter()
    done = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    wall = time.perf_counter() - began
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr}")
    peak = next(line for line in done.stderr.splitlines() if line.startswith("peak"))
    return Ran(wall, 1024 * float(peak.split()[1]), done.stdout)


def imports(log: Path) -> str:
    """Code that imports what a run of the pour imports of other people's, and nothing else."""
    names = run(LIBRARIES, [str(POUR), str(log)]).out.split()
    quoted = ", ".join(repr(name) for name in names)
    return f"import importlib\nfor name in [{quoted}]:\n    importlib.import_module(name)"


def command_rows(rounds: int) -> list[Row]:
    """The whole command, and its memory."""
    ratios, shares, peaks = [], [], []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        log = Path(folder) / "pour.mcap"
        bare_imports = imports(log)
        whole_command = ["run", str(POUR), "--format", "json", "--log", str(log), "--force"]
        run(bare_imports)
        run(MANIPCLI, whole_command)
        for _ in range(rounds):
            bare = run(bare_imports)
            whole = run(MANIPCLI, whole_command)
            simulated = json.loads(whole.out)["timing"]["simulate"]
            ratios.append(whole.wall / (simulated + 1.3 * bare.wall + 0.5))
            shares.append((whole.wall - simulated) / bare.wall)
            peaks.append((whole.peak - bare.peak) / MEGABYTE)
    return [
        Row("manipcli run / (simulate + 1.3 imports + 0.5 s)", tuple(ratios), "x", 1.0, "whole command, fresh process"),
        Row("the command without its simulate phase / imports", tuple(shares), "x", None, "for orientation"),
        Row("peak memory above bare imports", tuple(peaks), "MB", 150.0),
    ]


def help_row(rounds: int) -> Row:
    """The help, which imports nothing heavy."""
    ratios = []
    run("import typer")
    run(MANIPCLI, ["--help"])
    for _ in range(3 * rounds):
        bare = run("import typer")
        ratios.append(run(MANIPCLI, ["--help"]).wall / bare.wall)
    return Row("manipcli --help / python -c 'import typer'", tuple(ratios), "x", 1.5)


def long_rows() -> list[Row]:
    """Memory of a run of ten simulated minutes, above that of one of ten seconds."""
    peaks = []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        for seconds in (10, 600):
            task = Path(folder) / f"wait_{seconds}.yaml"
            text = POUR.read_text(encoding="utf-8")
            head, _ = text.split("steps:\n")
            head = head.replace("../", f"{ROOT}/").replace("task: pour", f"task: wait_{seconds}")
            task.write_text(f"{head}steps:\n  - wait: {seconds} s\n", encoding="utf-8")
            log = Path(folder) / f"wait_{seconds}.mcap"
            peaks.append(run(MANIPCLI, ["run", str(task), "--quiet", "--log", str(log)]).peak)
    return [Row("peak memory of 600 s above that of 10 s", ((peaks[1] - peaks[0]) / MEGABYTE,), "MB", 10.0)]
