"""`check` of a variant of a task: `--set`, `--seed` and `--sample` mean what they mean to `plan`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from manipcli.cli.app import main

TASK = """task: t
robot: robot.yaml
controllers: c.yaml
start: zero
steps: [{move: {to: up}}]
vary: {robot.poses.up.all.0: {choice: [1.5, 1.6]}}
"""
"""Joint `hinge` turns by 2 rad at most."""


@pytest.fixture
def task(pendulum: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> str:
    folder = pendulum(
        "poses: {zero: {all: [0]}, up: {all: [1.2]}}\ntool: {link: arm}\nlimits: {hinge: {acceleration: 30}}\n"
    )
    (folder / "c.yaml").write_text("controllers:\n  c: {type: computed_torque, joints: [hinge]}\n")
    (folder / "task.yaml").write_text(TASK)
    monkeypatch.chdir(folder)
    return "task.yaml"


@pytest.mark.parametrize(
    ("variant", "told"),
    [
        ([], ""),
        (["--set", "robot.poses.up.all.0=1.9"], ""),
        (["--set", "robot.poses.up.all.0=2.1"], "outside its limits"),
        (["--set", "robot.pose.up.all.0=2.1"], "error[ROBOT"),
        (["--sample", "1"], ""),
        (["--set", "robot.limits.hinge.upper=1.4"], ""),
        (["--set", "robot.limits.hinge.upper=1.4", "--sample", "1"], "(sample 1)"),
        (["--seed", "7"], ""),
    ],
)
def test_the_variant_is_what_is_checked(
    task: str, variant: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code = main(["check", task, *variant])
    said = capsys.readouterr().out
    assert code == (1 if told else 0)
    assert told in said
    assert (main(["plan", task, *variant]) != 0) == bool(told)


@pytest.mark.parametrize("variant", [["--set", "a=1"], ["--seed", "1"], ["--sample", "0"]])
def test_of_other_files_there_is_no_variant(task: str, variant: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "robot.yaml", *variant]) == 4
    said = capsys.readouterr()
    assert not said.out
    assert "USE052" in said.err
