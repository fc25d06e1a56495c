"""Generated pages are what their scripts write now."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

from manipcli.cli.app import COMMANDS
from manipcli.cli.command_help import EXIT_CODES

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "docs" / "scripts"


@pytest.mark.parametrize("script", ["write_commands.py"])
def test_a_page_is_what_its_script_writes(script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)
    written = runpy.run_path(str(SCRIPTS / script))
    assert written["PAGE"].read_text(encoding="utf-8") == f"{written['page']()}\n", f"run docs/scripts/{script}"


def test_every_command_has_exit_codes() -> None:
    assert list(EXIT_CODES) == list(COMMANDS)


def test_the_page_of_commands_has_every_variable_of_the_environment() -> None:
    read = {
        name
        for path in (ROOT / "manipcli").rglob("*.py")
        for name in re.findall(r"(?<!\w)MANIPCLI_[A-Z_]+", path.read_text(encoding="utf-8"))
    }
    page = (ROOT / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    assert sorted(name for name in read if f"`{name}" not in page) == []
    assert len(read) > 5
