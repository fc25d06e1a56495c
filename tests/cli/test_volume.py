"""`-h`, `--quiet` and `--verbose` are options of every command."""

from __future__ import annotations

import inspect

import pytest

from manipcli.cli import app, console
from manipcli.cli.volume import with_volume
from manipcli.core.errors import ExitCode


@pytest.mark.parametrize("name", app.COMMANDS)
def test_every_command_has_both_once_and_short_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    parameters = inspect.signature(with_volume(app.COMMANDS[name])).parameters
    assert {"quiet", "verbose"} <= set(parameters)
    assert app.main([*name.split(), "-h"]) == ExitCode.PASSED
    text = capsys.readouterr().out
    assert text.count("-q, --quiet") == text.count("-v, --verbose") == text.count("-h, --help") == 1


def test_both_together_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.main(["list", "-q", "-v"]) == ExitCode.USAGE
    assert "exclude each other" in capsys.readouterr().err


def test_quiet_silences_talk_but_no_error_and_ends_with_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.main(["list", "steps", "-q"]) == ExitCode.PASSED
    console.talk("note")
    console.error("error")
    console.detail("detail")
    assert capsys.readouterr().err == "error\n"
    console.prepare()
    console.talk("note")
    assert capsys.readouterr().err == "note\n"
