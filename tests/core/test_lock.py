"""Who has a file, and who is told so."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from manipcli.core.lock import Taken, lock


def test_one_process_has_a_file_or_several_share_it(tmp_path: Path) -> None:
    path = tmp_path / "a"
    with path.open("wb") as one, path.open("rb") as other:
        lock(one.fileno(), shared=True)
        lock(other.fileno(), shared=True)
        with pytest.raises(Taken):
            lock(one.fileno())
    with path.open("wb") as one, path.open("rb") as other:
        lock(one.fileno())
        with pytest.raises(Taken):
            lock(other.fileno(), shared=True)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_where_there_are_no_locks_everybody_gets_the_file(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def refuse(*_: object) -> None:
        raise OSError(number, "")

    monkeypatch.setattr("manipcli.core.lock.flock", refuse)
    lock(0)


def test_any_other_refusal_is_no_lock(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("manipcli.core.lock.flock", refuse)
    with pytest.raises(OSError, match=r"Input/output error"):
        lock(0)
