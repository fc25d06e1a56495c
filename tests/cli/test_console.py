"""What reaches a terminal: nothing that it would obey, colour only where it is wanted."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.cli import console


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@given(st.text())
def test_no_control_character_reaches_the_terminal(text: str) -> None:
    terminal = Terminal()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NO_COLOR", "1")
        patch.setattr("sys.stdout", terminal)
        console.result(text)
    for character in terminal.getvalue():
        assert character == "\n" or (ord(character) >= 0x20 and not 0x7F <= ord(character) <= 0x9F)


def test_a_title_in_a_file_cannot_recolour_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = io.StringIO()
    monkeypatch.setattr("sys.stdout", plain)
    console.result("\x1b[31mred\u202e\nnext")
    assert plain.getvalue() == "\\x1b[31mred\\u202e\nnext\n"


@pytest.mark.parametrize(
    ("environment", "coloured"),
    [({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "dumb"}, False)],
)
def test_colour_is_for_terminals_that_want_it(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], coloured: bool
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    terminal = Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    console.result("✓ passed")
    assert ("\x1b[" in terminal.getvalue()) is coloured
    assert "passed" in terminal.getvalue()


def test_a_file_gets_no_colour(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = io.StringIO()
    monkeypatch.setattr("sys.stdout", plain)
    console.result("✓ passed")
    assert plain.getvalue() == "✓ passed\n"


def test_what_the_encoding_lacks_is_written_as_its_code(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(raw, encoding="ascii"))
    console.prepare()
    console.result("✓ \udc80")
    assert raw.getvalue() == b"\\u2713 \\udc80\n"


@pytest.mark.parametrize(("count", "told"), [(0, 0), (5, 5), (6, 5), (40, 5)])
def test_of_much_that_is_not_drawn_some_is_told_and_the_rest_counted(
    capsys: pytest.CaptureFixture[str], count: int, told: int
) -> None:
    console.not_drawn([f"shape {k}" for k in range(count)])
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == told
    if count > told:
        assert lines[-1] == f"not drawn: {count - told + 1} more"


@pytest.mark.parametrize(
    ("environment", "coloured"),
    [({"FORCE_COLOR": "1"}, True), ({"FORCE_COLOR": "0"}, False), ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False)],
)
def test_colour_can_be_forced_into_a_pipe(
    monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], coloured: bool
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    pipe = io.StringIO()
    monkeypatch.setattr("sys.stdout", pipe)
    console.result("✓ passed")
    assert ("\x1b[" in pipe.getvalue()) is coloured
