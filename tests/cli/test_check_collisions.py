"""`check --collisions`: the self-collision matrix of a robot."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

ROBOTS = Path(__file__).parents[2] / "robots"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_the_matrix_of_the_panda(call_cli: Any, tmp_path: Path) -> None:
    first = call_cli("check", ROBOTS / "panda/robot.yaml", "--collisions", cwd=tmp_path)
    assert first.code == 0 and "panda_hand" in first.out and "10000 samples" in first.out
    assert "sampling 10000 configurations" in first.err
    again = call_cli("check", ROBOTS / "panda/robot.yaml", "--collisions", cwd=tmp_path)
    assert (again.out, again.err) == (first.out, "")
    found = json.loads(
        call_cli("check", ROBOTS / "panda/robot.yaml", "--collisions", "--format", "json", cwd=tmp_path).out
    )
    shares = {tuple(each["links"]): each for each in found["pairs"]}
    assert shares["panda_hand", "panda_link5"]["checked"] and shares["panda_hand", "panda_link5"]["share"] > 0.05
    assert shares["panda_link0", "panda_link1"]["overlap"] == "adjacent"
    assert found["never_below"] == pytest.approx(3e-4, rel=0.01)


def test_two_files_have_no_one_matrix(call_cli: Any, tmp_path: Path) -> None:
    file = ROBOTS / "panda/robot.yaml"
    refused = call_cli("check", file, file, "--collisions", cwd=tmp_path)
    assert refused.code == 4 and "--collisions takes one file" in refused.err
