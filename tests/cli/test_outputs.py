"""Where commands write: never over what they read, and told before there is any work."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import NoReturn

import pytest

from manipcli.cli.app import main
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import InvalidInput
from manipcli.record.faults import RecordingFailed

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
    assert "the command already uses this file" in capsys.readouterr().err
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


@pytest.mark.slow
@pytest.mark.parametrize("missing", ["report.html", "junit.xml"])
def test_no_page_of_an_earlier_run_stays_beside_a_new_log(
    folder: Path, monkeypatch: pytest.MonkeyPatch, missing: str
) -> None:
    """Where the disk is full when the files about the run are written, what there was before is gone, too."""
    words = ["run", str(TASK), "--set", "simulation.engine=kinematic", "-q", "--report", "report.html"]
    (folder / "real.xml").write_text("old")
    (folder / "junit.xml").symlink_to("real.xml")
    (folder / "report.html").write_text("old")

    def full(path: Path, data: bytes) -> None:
        if path.name == missing:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        path.write_bytes(data)

    monkeypatch.setattr("manipcli.core.whole_file.write_whole", full)
    assert main([*words, "--junit", "junit.xml"]) == 3
    assert (folder / "runs" / "home.mcap").is_file()
    assert not (folder / missing).exists()
    assert all(
        "old" not in path.read_text("utf-8") for path in (folder / "report.html", folder / "junit.xml") if path.exists()
    )


@pytest.mark.parametrize("room", [True, False])
def test_a_run_whose_log_the_disk_refused_is_not_told_by_the_page_of_an_earlier_one(
    folder: Path, monkeypatch: pytest.MonkeyPatch, room: bool
) -> None:
    for name in ("report.html", "junit.xml"):
        (folder / name).write_text("old")

    def failing(*_: object, **__: object) -> NoReturn:
        raise RecordingFailed(folder / "home.mcap.partial", "No space left on device", time=1.5)

    def full(path: Path, data: bytes) -> NoReturn:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("manipcli.pipeline.run_task", failing)
    if not room:
        monkeypatch.setattr("manipcli.core.whole_file.write_whole", full)
    assert main(["run", str(TASK), "--report", "report.html", "--junit", "junit.xml"]) == 3
    for path in (folder / "report.html", folder / "junit.xml"):
        assert path.exists() == room
        assert not room or "recording stopped at t = 1.500 s" in path.read_text("utf-8")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a file system that refuses new files")
def test_a_folder_that_refuses_files_is_found_before_the_run(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as caught:
        check_outputs(("--report", Path("/proc/x.html")))
    assert caught.value.findings[0].code == "USE082"
    check_outputs(("--report", tmp_path / "x.html"))
    assert not [path for path in tmp_path.iterdir() if "x.html" in path.name]
