"""`manipcli export LOG`: what does not fit the file is refused before anything is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import PourRun

RunCli = Callable[..., Any]
ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        ((), "USE096", "expected --foxglove or --rerun or --rosbag2 or --glb or --files"),
        (("--ros2", "out"), "USE097", "--ros2 needs a robot or a task"),
        (("--glb", "run.glb", "--seed", "1", "--set", "a=1"), "USE097", "--seed, --set need a robot or a task"),
        (("--glb", "."), "USE082", "is a folder"),
        (("--glb", "run.gltf"), "USE098", "'run.gltf' is not a .glb file"),
    ],
)
def test_a_log_is_not_exported_as_something_else(
    words: tuple[str, ...], code: str, text: str, pour_run: PourRun, tmp_path: Path, call_cli: RunCli
) -> None:
    ran = call_cli("export", pour_run.log, *words, cwd=tmp_path)
    assert ran.code == 4
    assert f"error[{code}]" in ran.err and text in ran.err
    assert not [*tmp_path.iterdir()]


def test_a_task_has_no_motion_to_export(tmp_path: Path, call_cli: RunCli) -> None:
    ran = call_cli("export", ROOT / "tasks/pour.yaml", "--glb", "run.glb", "--files", "out", cwd=tmp_path)
    assert ran.code == 4
    assert "error[USE097]: --glb, --files need a log" in ran.err and "manipcli run TASK" in ran.err
    assert not [*tmp_path.iterdir()]
