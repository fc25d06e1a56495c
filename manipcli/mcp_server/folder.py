"""The folder that a server of tools is confined to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

RUNS: Final = "runs"
"""Folder of the logs, the only one that tools write to."""
LONGEST: Final = 1000
"""Longest path or text of an argument [characters]."""


class Outside(ValueError):
    """An argument that is not a path in the folder."""


@dataclass(frozen=True, slots=True)
class Folder:
    """`root`: the folder, without symbolic links."""

    root: Path

    @classmethod
    def of(cls, path: Path) -> Folder:
        """
        Raises:
            OSError: there is no such folder.
        """
        found = path.resolve(strict=True)
        if not found.is_dir():
            raise NotADirectoryError(20, "not a folder")
        return cls(found)

    def file(self, word: str) -> str:
        """A path in the folder, relative to it; symbolic links are followed first.

        Raises:
            Outside: the path is outside, or no path.
        """
        return self._inside(word, self.root, "the folder of this server")

    def log(self, word: str) -> str:
        """The path of a log to write, `runs/NAME.mcap`, from `NAME` or `runs/NAME.mcap`; its folder is created.

        Raises:
            Outside: it is not below `runs`, or `runs` is elsewhere.
        """
        name = word.removeprefix(f"{RUNS}/").removesuffix(".mcap")
        where = self.root / RUNS
        if where.resolve() != where:
            raise Outside(f"'{RUNS}' is a symbolic link; logs are written to a folder '{RUNS}' only")
        found = self._inside(f"{RUNS}/{name}.mcap", where, f"the folder '{RUNS}'")
        try:
            (self.root / found).parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Outside(f"the folder of '{found}' cannot be created: {error.strerror}") from None
        return found

    def _inside(self, word: str, root: Path, what: str) -> str:
        if not word or len(word) > LONGEST or not word.isprintable():
            raise Outside(f"a path is a text of 1 to {LONGEST} printable characters")
        try:
            found = (self.root / word).resolve()
        except (OSError, RuntimeError):
            raise Outside(f"'{word}' cannot be resolved") from None
        if found == root or not found.is_relative_to(root):
            raise Outside(f"'{word}' is not in {what}; paths are relative to it")
        return str(found.relative_to(self.root))
