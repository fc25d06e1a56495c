"""A diverged MuJoCo world is an error, not a silent reset; nothing is printed, and no file is written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
WORLD = """
import sys
import numpy as np
sys.path.insert(0, {tests!r})
from test_mujoco_world import body, commanded, opened, robot, stepped
from manipcli.shapes.primitives import Box, Sphere
"""
DIVERGES = """
from manipcli.core.errors import SimulationFailed
engine = opened(robot())
engine.write(commanded("effort", {effort}))
try:
    stepped(engine, 5)
except SimulationFailed as failed:
    sys.exit(0 if "not finite" in str(failed) and failed.time == {time} else str(failed))
sys.exit("no error")
"""
FALLS = """
table = body("table", Box((1.0, 1.0, 0.2)), (2.0, 0.0, 0.4), fixed=True)
blocks = [body(f"b{k}", Box((0.1, 0.1, 0.1)), (2.0 + 0.01 * k, 0.0, 0.6 + 0.15 * k)) for k in range(4)]
engine = opened(robot(Box((0.1, 0.1, 0.1))), table, *blocks)
for _ in range(600):
    engine.advance()
print(engine.read().numbers.tobytes().hex(), engine.contacts())
"""


def run(folder: Path, script: str, **environment: str) -> subprocess.CompletedProcess[str]:
    head = WORLD.format(tests=str(Path(__file__).parent))
    return subprocess.run(
        [sys.executable, "-c", head + script], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    )  # fmt: skip


def test_a_state_that_is_not_finite_is_an_error_without_output(tmp_path: Path) -> None:
    """An effort that is not a number makes an acceleration that is not finite in the first step."""
    done = run(tmp_path, DIVERGES.format(effort="np.nan", time=1e-3))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []


def test_two_processes_get_the_same_bytes(tmp_path: Path) -> None:
    """Blocks fall on a table and on each other; the hash seed differs."""
    one, two = (run(tmp_path, FALLS, PYTHONHASHSEED=seed) for seed in ("1", "2"))
    assert one.returncode == 0, one.stderr
    assert len(one.stdout) > 1000
    assert one.stdout == two.stdout
    assert one.stderr == two.stderr == ""
