"""`manipcli replay LOG --picture, --sheet, --video`: what it writes, and what it says when it cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from manipcli.cli.app import main

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run without physics: the arm follows a path home."""
    path = tmp_path_factory.mktemp("pictures") / "home.mcap"
    words = ["run", str(ROOT / "tasks" / "home.yaml"), "--log", str(path), "--set", "simulation.engine=kinematic", "-q"]
    assert main(words) in (0, 1)
    return path


@pytest.mark.slow
def test_a_moment_all_steps_and_a_film_are_drawn_at_once(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    picture, sheet, video = (tmp_path / name for name in ("a.png", "b.png", "c.webp"))
    words = ["--picture", picture, "--at", "0.2", "--sheet", sheet, "--video", video, "--size", "160x120", "--fps", "5"]
    assert main(["replay", str(log), *map(str, words)]) == 0
    told = capsys.readouterr()
    assert told.out.split() == [str(picture), str(sheet), str(video)]
    assert "frames/s" in told.err
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.png", "b.png", "c.webp"]
    with Image.open(picture) as image:
        assert image.size == (160, 120)
        # The dark rings of the arm, before a light floor, between the captions.
        middle = np.asarray(image)[20:-20]
        assert 20 < (middle.max(axis=2) < 90).sum() < middle[..., 0].size // 4


@pytest.mark.slow
def test_a_log_without_its_end_is_drawn_too(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    cut = tmp_path / "a.mcap.partial"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size * 4 // 5])
    assert main(["replay", str(cut), "--picture", str(tmp_path / "a.png"), "--size", "96x72"]) == 0
    assert "not finished" in capsys.readouterr().err
    assert (tmp_path / "a.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["--at", "1"], "USE062", "add --picture"),
        (["--speed", "1"], "USE062", "add --video"),
        (["--fps", "25", "--sheet", "x.png"], "USE062", "add --video"),
        (["--view", "iso"], "USE062", "add --picture, --sheet or --video"),
        (["--size", "9x9", "--html", "x.html"], "USE062", "add --picture, --sheet or --video"),
        (["--picture", "a.jpg"], "USE063", "is not a .png file"),
        (["--sheet", "a.pdf"], "USE063", "is not a .png file"),
        (["--picture", "a.png", "--at", "fellow_1"], "REPLAY011", "did you mean 'follow_1'?"),
        (["--picture", "a.png", "--at", "900"], "REPLAY012", "outside the run"),
        (["--picture", "a.png", "--size", "big"], "REPLAY013", "WIDTHxHEIGHT"),
        (["--picture", "a.png", "--view", "below"], "REPLAY010", "iso, front"),
        (["--picture", "/dev/null/a.png"], "USE082", "--picture '/dev/null/a.png': cannot create folder '/dev/null'"),
        (["--video", "a.avi"], "REPLAY015", ".mp4, .webp, .gif"),
        (["--video", "a.gif", "--fps", "0"], "REPLAY014", "0 frames per second are outside"),
        (["--video", "a.gif", "--speed", "0.0001"], "REPLAY014", "fewer frames"),
    ],
)
def test_what_cannot_be_drawn_is_refused(
    log: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    code: str,
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["replay", str(log), *words]) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert f"error[{code}]" in told.err
    assert says in told.err
    assert list(tmp_path.iterdir()) == []
