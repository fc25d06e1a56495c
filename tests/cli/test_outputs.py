"""Where commands write: never over what they read, and told before there is any work."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.cli.app import main

TASK = Path(__file__).parents[2] / "tasks" / "home.yaml"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: a file, another name of it, and a link that leads nowhere."""
    (tmp_path / "a.png").write_text("mine")
    (tmp_path / "b.png").symlink_to("a.png")
    (tmp_path / "loop").symlink_to("loop")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("output", ["a.png", "b.png", "./a.png"])
@pytest.mark.parametrize(
    "words",
    [
        ["plot", "a.png", "--csv"],
        ["plot", "a.png", "-o"],
        ["replay", "a.png", "--html"],
        ["replay", "a.png", "--sheet"],
        ["plan", "a.png", "--csv"],
        ["check-urdf", "a.png", "--picture"],
        ["tune", "a.png", "c.yaml", "--force", "--write"],
        ["judge", "a.png", "--report"],
        ["run", "a.png", "--junit"],
        ["replay", "x.mcap", "--html", "a.png", "--sheet"],
    ],
)
def test_no_command_writes_over_a_file_that_it_has(
    folder: Path, words: list[str], output: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.name for path in folder.iterdir())
    assert main([*words, output]) == 4
    assert "the same command has that file already" in capsys.readouterr().err
    assert (folder / "a.png").read_text() == "mine"
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.parametrize("command", ["run", "check", "plan", "check-urdf", "info", "judge", "replay", "plot", "repair"])
def test_a_link_to_itself_is_no_file(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "loop"]) in (1, 4)
    told = capsys.readouterr()
    assert "bug in manipcli" not in told.err
    assert "loop" in told.out + told.err


@pytest.mark.slow
def test_a_log_that_stays_keeps_its_page_and_its_junit(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing was run the second time, so that what the first has written still tells of the log that is there."""
    words = ["run", str(TASK), "--log", "x.mcap", "--junit", "j.xml", "--report", "p.html", "--quiet"]
    assert main(words) == 0
    before = {name: (folder / name).read_bytes() for name in ("x.mcap", "j.xml", "p.html")}
    assert main(words) == 4
    assert "the file exists" in capsys.readouterr().err
    assert {name: (folder / name).read_bytes() for name in before} == before
