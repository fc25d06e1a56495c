"""Files that are there whole or not at all."""

from __future__ import annotations

import errno
import os
import threading
from pathlib import Path

import pytest

from manipcli.core.whole_file import whole_file, write_whole


def test_what_fails_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text("before")

    def broken() -> None:
        with whole_file(path) as partial:
            partial.write_text("half")
            raise ValueError

    with pytest.raises(ValueError):
        broken()
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]
    write_whole(path, b"after")
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    link, path = tmp_path / "link", tmp_path / "folder" / "a"
    path.parent.mkdir()
    path.write_text("before")
    link.symlink_to(path)
    write_whole(link, b"after")
    assert link.is_symlink()
    assert path.read_text() == "after"


def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    write_whole(pipe, b"through")
    reader.join(timeout=60)
    assert got == [b"through"]
    assert pipe.is_fifo()


def test_where_nothing_can_be_written_the_name_that_was_given_is_told(tmp_path: Path) -> None:
    path = tmp_path / "absent" / "a"
    with pytest.raises(FileNotFoundError) as refused:
        write_whole(path, b"")
    assert refused.value.filename == str(path)


def test_a_full_disk_names_the_file_that_was_given(tmp_path: Path) -> None:
    path = tmp_path / "a"
    with pytest.raises(OSError, match="full") as refused, whole_file(path):
        raise OSError(errno.ENOSPC, "full")  # as a write raises it: without a name
    assert (refused.value.filename, [*tmp_path.iterdir()]) == (str(path), [])
    with pytest.raises(OSError, match="No space left") as refused:
        write_whole(Path("/dev/full"), b"x")
    assert refused.value.filename == "/dev/full"
