"""`check --watch` with a clock that changes the files: each change is checked once, when the files are complete."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from manipcli.cli import watch as module
from manipcli.cli.app import main
from manipcli.cli.watch import LONGEST, PERIOD, watch

Act = Callable[[], object]
ROOT = Path(__file__).parents[2]
TASK = f"""# yaml-language-server: $schema=task.json
task: t
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
steps:
  - id: stretch
    move: {{to: home}}
"""


def clock(acts: Sequence[Act | None]) -> Callable[[float], None]:
    """A sleep that does one act each time, and ends with Ctrl-C."""
    waiting: Iterator[Act | None] = iter(acts)

    def sleep(seconds: float) -> None:
        assert seconds == PERIOD
        try:
            act = next(waiting)
        except StopIteration:
            raise KeyboardInterrupt from None
        if act is not None:
            act()

    return sleep


def watched(path: Path, acts: Sequence[Act | None], *, more: Sequence[Path] = ()) -> list[tuple[str, tuple[str, ...]]]:
    """What each round read, and which files had changed."""
    rounds: list[tuple[str, tuple[str, ...]]] = []

    def check(changed: tuple[Path, ...]) -> Sequence[Path]:
        text = path.read_text() if path.exists() else "missing"
        rounds.append((text, tuple(sorted(file.name for file in changed))))
        return more

    with pytest.raises(KeyboardInterrupt):
        watch(check, sleep=clock(acts))
    return rounds


def renamed(path: Path, text: str) -> None:
    """As editors write: a new file takes the place of the old one."""
    new = path.with_suffix(".new")
    new.write_text(text)
    new.replace(path)


def test_a_change_is_checked_once(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("1")
    assert watched(path, [None] * 5) == [("1", ())]
    path.write_text("1")
    acts = [None, lambda: renamed(path, "two"), *[None] * 4, lambda: path.write_text("three!"), *[None] * 4]
    assert watched(path, acts) == [("1", ()), ("two", ("a.yaml",)), ("three!", ("a.yaml",))]


def test_a_file_that_is_being_written_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("1")
    acts = [path.unlink, None, lambda: path.write_text(""), lambda: path.write_text("tw"), lambda: renamed(path, "two")]
    assert watched(path, [*acts, *[None] * 4]) == [("1", ()), ("two", ("a.yaml",))]


def test_a_file_that_is_gone_is_reported_in_the_end_and_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("1")
    acts = [path.unlink, *[None] * (LONGEST + 2), lambda: path.write_text("2"), *[None] * 4]
    assert watched(path, acts, more=[path]) == [("1", ()), ("missing", ("a.yaml",)), ("2", ("a.yaml",))]


def test_a_change_during_the_check_is_not_lost(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("1")
    texts = []

    def check(_: tuple[Path, ...]) -> Sequence[Path]:
        texts.append(path.read_text())
        if len(texts) == 1:
            path.write_text("later")
        return ()

    with pytest.raises(KeyboardInterrupt):
        watch(check, sleep=clock([None] * 4))
    assert texts == ["1", "later"]


def test_what_it_writes_itself_starts_no_round(tmp_path: Path) -> None:
    path, own = tmp_path / "a.yaml", tmp_path / "own.json"
    path.write_text("1")
    rounds = []

    def check(_: tuple[Path, ...]) -> Sequence[Path]:
        rounds.append(path.read_text())
        own.read_text() if own.exists() else None
        own.write_text(f"{len(rounds)}")
        return ()

    with pytest.raises(KeyboardInterrupt):
        watch(check, lambda file: file == own, sleep=clock([None] * 5))
    assert rounds == ["1"]


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(TASK)
    assert main(["schema", "task"]) == 0
    (tmp_path / "task.json").write_text(capsys.readouterr().out)
    acts = [
        lambda: renamed(path, TASK.replace("home", "hmoe")),
        *[None] * 2,
        lambda: path.write_bytes(b"\xff\x00task: ["),
        *[None] * 2,
        path.unlink,
        *[None] * (LONGEST + 2),
        lambda: path.write_text(TASK.replace("stretch", "reach_up")),
        *[None] * 2,
    ]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module.time, "sleep", clock(acts))
    monkeypatch.setattr(watch, "__kwdefaults__", {"sleep": module.time.sleep})
    assert main(["check", "--watch", "task.yaml"]) == 0
    printed = capsys.readouterr()
    assert "Traceback" not in printed.out + printed.err
    assert printed.out.count("failed: 1 file checked") == 3
    assert "did you mean 'home'?" in printed.out
    assert "there is no such file" in printed.out
    first, last = printed.out.split("✓ passed")[1:]
    assert "stretch  move" in first
    assert "reach_up  move" in last
    assert printed.err.count("now has the names of task.yaml") >= 2
    assert "reach_up" in json.dumps(json.loads((tmp_path / "task.json").read_text()))


def test_watch_has_no_matrix(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "--watch", "--collisions", str(tmp_path)]) == 4
    assert "exclude each other" in capsys.readouterr().err
