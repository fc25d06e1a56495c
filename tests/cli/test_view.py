"""`manipcli view`: what it opens, what it refuses, and that Ctrl-C ends it well."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import cast
from urllib.request import urlopen

import pytest

from manipcli.cli.app import main
from manipcli.cli.commands.view import _follow
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError
from manipcli.core.opened_files import opened_by
from manipcli.pipeline import Sight, load_sight
from manipcli.replay.view.view import View

ROOT = Path(__file__).parents[2]
LINK = '<robot name="one"><link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link></robot>'


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_prints_the_address_and_ends_well(tmp_path: Path, number: signal.Signals) -> None:
    path = tmp_path / "one.urdf"
    path.write_text(LINK)
    command = [sys.executable, "-m", "manipcli", "view", str(path), "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url.startswith("http://127.0.0.1:")
        with urlopen(url, timeout=120) as answer:
            assert b"<html" in answer.read()
        process.send_signal(number)
        out, told = process.communicate(timeout=120)
    assert process.returncode == 0
    assert out == ""
    assert "Traceback" not in told


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["gone.urdf"], "USE101", "no such file"),
        (["one.urdf", "side=left"], "USE045", "NAME:=VALUE"),
        (["one.urdf", "side:=left"], "XACRO003", "side"),
        (["robot.yaml", "side:=left"], "VIEW002", "side"),
        (["controllers.yaml"], "VIEW003", "controllers"),
        (["broken.urdf"], "URDF", "broken.urdf:1:"),
    ],
)
def test_what_cannot_be_shown_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    code: str,
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("one.urdf").write_text(LINK)
    Path("broken.urdf").write_text('<robot name="one"><joint name="j"/></robot>')
    Path("robot.yaml").write_text("robot: one\ndescription: one.urdf\n")
    Path("controllers.yaml").write_text("controllers: {}\n")
    assert main(["view", *words]) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert code in told.err
    assert says in told.err


@pytest.mark.parametrize("port", ["-1", "70000", "x"])
def test_a_port_is_a_number(port: str) -> None:
    assert main(["view", "one.urdf", "--port", port]) == 4


@pytest.mark.slow
def test_a_changed_file_is_shown_and_one_with_errors_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "one.urdf"
    path.write_text(LINK)
    command = [sys.executable, "-m", "manipcli", "view", str(path), "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with (
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
        ) as process,
        ExitStack() as ended,
    ):
        ended.callback(process.kill)  # also where an assertion fails: Popen waits for its end
        assert process.stdout is not None
        assert process.stderr is not None
        url = process.stdout.readline().strip()
        path.write_text(LINK.replace("</robot>", '<joint name="j"/></robot>'))
        lines = [process.stderr.readline() for _ in range(2)]
        while "changed: one.urdf" not in lines[-2]:
            lines.append(process.stderr.readline())
        assert "one.urdf:1:" in lines[-1]
        path.write_text(LINK.replace("1 1 1", "2 1 1"))
        while "changed: one.urdf" not in (line := process.stderr.readline()):
            assert "one.urdf:1:" in line or "hint" in line or "more about a code" in line
        with urlopen(url, timeout=120) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=120)
    assert process.returncode == 0
    assert "error" not in told
    assert "Traceback" not in told


def test_a_change_is_given_to_the_page_and_an_error_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "one.urdf"
    path.write_text(LINK)
    sight, opened = opened_by(lambda: load_sight(path))
    shown: list[object] = []
    notes: list[str] = []
    page = SimpleNamespace(
        replace=lambda robot, scene, q: shown.append(robot), notify=lambda title, text: notes.append(text)
    )
    answers: list[Sight | ManipcliError] = [sight, InvalidInput([Diagnostic("URDF080", "the description has no link")])]

    def load() -> Sight:
        answer = answers.pop(0)
        if isinstance(answer, ManipcliError):
            raise answer
        return answer

    def two_changes(show: Callable[[tuple[Path, ...]], object], ignored: object) -> None:
        show(())  # nothing changed since it was loaded
        assert shown == []
        show((path,))
        show((path,))

    monkeypatch.setattr("manipcli.cli.commands.view.watch", two_changes)
    _follow(cast(View, page), load, path, opened)
    assert shown == [sight.robot]
    assert len(notes) == 1
    assert "no link" in notes[0]
    assert "manipcli explain URDF080" in capsys.readouterr().err
