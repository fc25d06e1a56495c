"""A task that cannot be used has its page among the others, in its own process or without one."""

from __future__ import annotations

from multiprocessing import Pipe
from pathlib import Path

import pytest

from manipcli.batch.child import _Beats, _end_of
from manipcli.batch.discovery import read_case
from manipcli.batch.job import Job, Settings
from manipcli.batch.process import run_job

UNKNOWN = "task: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps: [{wiat: 1 s}]\n"
"""No step is called that."""
BROKEN = "task: t\nrobot: [\n"


def _job(text: str) -> Job:
    Path("t.yaml").write_text(text)
    return Job(
        read_case(Path("t.yaml"), shown="t.yaml"), Path("t.yaml"), Settings(folder=Path("logs"), pages=Path("pages"))
    )


def _shown(page: Path) -> str:
    text = page.read_text("utf-8")
    assert 'href="index.html"' in text
    return text


def test_its_page_tells_errors_and_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ours, theirs = Pipe()
    with ours, theirs:
        end = _end_of(_job(UNKNOWN), _Beats(theirs))  # type: ignore[arg-type]
    assert end.report is None and end.findings and end.notes == ()
    text = _shown(Path("pages/t.html"))
    assert "t.yaml:4:10" in text and "wiat" in text


def test_so_does_that_of_a_file_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    report = run_job(_job(BROKEN))
    assert (report.outcome, report.page) == ("invalid", "pages/t.html")
    assert report.findings[0].message in _shown(Path("pages/t.html"))


def test_a_page_that_cannot_be_written_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pages").write_text("")
    report = run_job(_job(BROKEN))
    assert report.page is None
    (note,) = report.notes
    assert note.startswith("no page: ")
