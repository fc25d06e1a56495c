"""Logs of live sessions are never replaced unasked."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

from manipcli.live.session import session_logs


def names(first: Path, *, overwrite: bool = False, named: bool = False) -> list[str]:
    return [path.name for path in islice(session_logs(first, overwrite=overwrite, named=named), 3)]


def test_logs_that_exist_or_are_being_written_are_left_out(tmp_path: Path) -> None:
    first = tmp_path / "a@live.mcap"
    assert names(first) == ["a@live.mcap", "a@live-2.mcap", "a@live-3.mcap"]
    first.touch()
    (tmp_path / "a@live-3.mcap.partial").touch()
    assert names(first) == ["a@live-2.mcap", "a@live-4.mcap", "a@live-5.mcap"]
    assert names(first, named=True) == ["a@live.mcap", "a@live-2.mcap", "a@live-4.mcap"]  # refused when it is opened
    assert names(first, overwrite=True) == ["a@live.mcap", "a@live-2.mcap", "a@live-3.mcap"]
