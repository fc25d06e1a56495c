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


@pytest.mark.parametrize("script", ["write_commands.py", "write_messages.py", "write_python.py"])
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


def test_the_page_of_messages_has_every_kind_of_event(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)
    known = set(runpy.run_path(str(SCRIPTS / "write_messages.py"))["EVENTS"])
    call = re.compile(r"event\(\s*(?:[\w.()]+,\s*)?(?:kind=)?\"(\w+)\"")
    files = [path for folder in ("run", "live", "judge") for path in (ROOT / "manipcli" / folder).rglob("*.py")]
    code = [path.read_text(encoding="utf-8") for path in files]
    written = {kind for text in code for kind in call.findall(text)}
    assert len(written) > 15
    assert written <= known
    assert [kind for kind in known - written if not any(f'"{kind}"' in text for text in code)] == []
