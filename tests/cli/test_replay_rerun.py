"""`manipcli replay LOG --rerun`: what it refuses before it reads a log. The viewer itself needs a screen."""

from __future__ import annotations

from importlib import util

import pytest

from manipcli.cli.app import main


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """rerun-sdk counts as installed."""
    monkeypatch.setattr("manipcli.replay.rerun.installed.find_spec", lambda name: util.find_spec("json"))


@pytest.mark.usefixtures("installed")
def test_rerun_needs_a_screen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["replay", "run.mcap", "--rerun"]) == 4
    assert "REPLAY018" in capsys.readouterr().err


def test_rerun_needs_its_extra(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("manipcli.replay.rerun.installed.find_spec", lambda name: None)
    assert main(["replay", "run.mcap", "--rerun"]) == 4
    said = capsys.readouterr().err
    assert "REPLAY017" in said and "pip install 'manipcli[rerun]'" in said


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("option", ["--port=8080", "--open"])
def test_the_page_is_not_served_beside_rerun(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "run.mcap", "--rerun", option]) == 4
    assert f"{option.partition('=')[0]}: no effect with --rerun" in capsys.readouterr().err
