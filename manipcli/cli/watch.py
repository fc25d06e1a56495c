"""Repeating a check whenever one of the files that it read changes: `check --watch`.

Files are polled. Editors replace files and leave them incomplete for a moment, so a change is acted on when all files
stay as they are for one period.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from manipcli.core.opened_files import Stamp, opened_by, stamp

PERIOD: Final = 0.3
"""[s] Between two looks at the files."""
LONGEST: Final = 10
"""Periods after which a change is acted on, also where a file is being written all the time."""
OWN: Final = (".py", ".pyc", ".so", ".pyd", ".pth", ".partial")
"""Suffixes of files that Python opens while it imports, or that are being written."""

Files = dict[Path, Stamp]


def watch(
    check: Callable[[tuple[Path, ...]], Iterable[Path]],
    ignored: Callable[[Path], bool] = lambda _: False,
    *,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Calls `check`, and again after each change, until it is interrupted.

    Args:
        check: (changed files; () at first) -> more files to watch, such as missing ones.
        ignored: whether changes of a file have no effect.
        sleep: waits [s].

    Raises:
        KeyboardInterrupt: by Ctrl-C; and whatever `check` raises.
    """
    files: Files = {}
    changed: tuple[Path, ...] = ()
    while True:
        before = {path: stamp(path) for path in files}
        more, opened = opened_by(lambda changed=changed: tuple(check(changed)))  # type: ignore[misc]
        files = {path.absolute(): stamp(path) for path in more} | before | dict(opened.stamps)
        files = {path: seen for path, seen in files.items() if path.suffix not in OWN and not ignored(path)}
        while not (changed := _changed(files)):
            sleep(PERIOD)
        _settle(files, sleep)
        changed = _changed(files) or changed


def _changed(files: Files) -> tuple[Path, ...]:
    return tuple(path for path, seen in files.items() if stamp(path) != seen)


def _settle(files: Files, sleep: Callable[[float], None]) -> None:
    """Waits until no file changes, and none that was there is missing, for one period."""
    seen = {path: stamp(path) for path in files}
    for _ in range(LONGEST):
        sleep(PERIOD)
        now = {path: stamp(path) for path in files}
        if now == seen and not any(now[path] is None and files[path] is not None for path in files):
            return
        seen = now
