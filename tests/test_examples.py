"""Every example does what its README says, with the command that stands there."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted(path for path in (ROOT / "examples").iterdir() if path.is_dir())
FAILS = {"06_failure": 1}
"""Exit codes other than 0."""


def command(example: Path) -> list[str]:
    """The one command of an example's README."""
    readme = (example / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```bash\n(.*?)\n```", readme, flags=re.DOTALL)
    program, *words = shlex.split(block)
    words = [str(ROOT / word) if word.startswith("examples/") else word for word in words]
    assert program in ("manipcli", "python")
    return [program, *words]


def shown(example: Path) -> str:
    """The output that the README shows."""
    (block,) = re.findall(r"```text\n(.*?)\n```", (example / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    return str(block)


def test_the_examples_are_those_that_the_index_lists() -> None:
    index = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"^\| \[(.+?)\]\(\1\)", index, flags=re.MULTILINE) == [example.name for example in EXAMPLES]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_an_example_is_small_and_says_what_to_change(example: Path) -> None:
    assert "**Change one thing**" in (example / "README.md").read_text(encoding="utf-8")
    scripts = [*example.glob("*.py")]
    assert len(scripts) <= 1
    assert all(len(script.read_text(encoding="utf-8").splitlines()) <= 50 for script in scripts)


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_an_example_does_what_its_readme_says(example: Path, tmp_path: Path, call_cli: Callable[..., Any]) -> None:
    program, *arguments = command(example)
    if program == "manipcli":
        ran = call_cli(*arguments, cwd=tmp_path)
        code, out, err = ran.code, ran.out, ran.err
    else:
        done = subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600,
            env={"PYTHONPATH": str(ROOT), "PATH": "", "PYTHONIOENCODING": "utf-8"},
        )  # fmt: skip
        code, out, err = done.returncode, done.stdout, done.stderr
    assert code == FAILS.get(example.name, 0), out + err
    expected = words(shown(example))
    assert expected == words(out)[: len(expected)]


@pytest.mark.slow
def test_without_its_reflex_the_hand_loses_the_cup(tmp_path: Path, call_cli: Callable[..., Any]) -> None:
    ran = call_cli(*command(ROOT / "examples" / "17_slip")[1:], "--set", "params.reflex=false", cwd=tmp_path)
    assert ran.code == 1
    assert "the hand does not carry 'cup': no robot link presses on it" in ran.out


def words(text: str) -> list[str]:
    """What stays the same on every machine: not numbers, and not which joint was the worst."""
    return re.findall(r"[A-Za-z_✓✗]\w*", re.sub(r"'?joint_\d'?", "", text))
