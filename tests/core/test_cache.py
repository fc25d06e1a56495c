"""The cache gives back what was stored, or nothing: no file in its folder can do harm."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from manipcli.core import cache
from manipcli.core.cache import cache_key, read_cached, write_cached


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "manipcli" / "kind"


def test_what_is_stored_is_found_by_its_key(folder: Path) -> None:
    assert read_cached("kind", "a") is None
    write_cached("kind", "a", b"one\n\x00")
    write_cached("kind", "b", b"")
    assert (read_cached("kind", "a"), read_cached("kind", "b"), read_cached("other", "a")) == (b"one\n\x00", b"", None)
    assert sorted(path.name for path in folder.iterdir()) == ["a", "b"]


def test_parts_of_a_key_are_not_run_together() -> None:
    assert len({cache_key("ab", "c"), cache_key("a", "bc"), cache_key("abc"), cache_key(b"ab", b"c", "")}) == 4
    assert cache_key("ab", "c") == cache_key(b"ab", b"c")


@pytest.mark.parametrize(
    "change", [lambda d: d[:-1], lambda d: d + b"x", lambda d: d[1:], lambda _: b"", lambda d: d[:20]]
)
def test_a_damaged_file_is_a_missing_one(folder: Path, change: object) -> None:
    assert callable(change)
    write_cached("kind", "a", b"content")
    (folder / "a").write_bytes(change((folder / "a").read_bytes()))
    assert read_cached("kind", "a") is None
    write_cached("kind", "a", b"content")
    assert read_cached("kind", "a") == b"content"


def test_a_pipe_a_folder_a_loop_and_a_large_file_are_missing_ones(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.mkdir(parents=True)
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    (folder / "loop").symlink_to("loop")
    for name in ("pipe", "folder", "loop"):
        assert read_cached("kind", name) is None
    write_cached("kind", "folder", b"content")  # cannot be written, and nothing happens
    write_cached("kind", "large", b"content")
    monkeypatch.setattr(cache, "MOST_BYTES", 10)
    assert read_cached("kind", "large") is None


@pytest.mark.parametrize("place", ["/proc/none", "/dev/null"])
def test_a_folder_that_cannot_be_written_is_no_error(monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", place)
    write_cached("kind", "a", b"content")
    assert read_cached("kind", "a") is None


def test_without_or_with_a_relative_variable_it_is_in_the_home_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    for value in (None, "", "relative"):
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        if value is not None:
            monkeypatch.setenv("XDG_CACHE_HOME", value)
        write_cached("kind", f"key{value}", b"content")
        assert (tmp_path / ".cache" / "manipcli" / "kind" / f"key{value}").is_file()
    assert not (tmp_path / "relative").exists()
