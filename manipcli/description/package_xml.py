"""ROS packages by the name in their `package.xml`, which need not be the name of their folder."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterator
from pathlib import Path

MOST_BYTES = 65_536
LEVELS_BELOW = 4
MOST_FOLDERS = 5_000
_NAME = re.compile(rb"<name>\s*([^<>\s]{1,200})\s*</name>")
_IGNORED = ("CATKIN_IGNORE", "COLCON_IGNORE", "AMENT_IGNORE", "rospack_nosubdirs")


def package_name(folder: Path) -> str | None:
    """The `<name>` of the package in this very folder, if there is one."""
    file = folder / "package.xml"
    try:
        if not file.is_file():
            return None
        with file.open("rb") as stream:
            found = _NAME.search(stream.read(MOST_BYTES))
    except OSError:
        return None
    return found[1].decode("utf-8", "replace") if found else None


def packages_below(folder: Path) -> dict[str, Path]:
    """The packages at or below a folder by name, the nearest of each, as rospack crawls.

    Packages hold no packages; hidden folders and those that a build tool is told to ignore are left out.
    """
    found: dict[str, Path] = {}
    for each in _packages_below(folder):
        found.setdefault(package_name(each) or each.name, each)
    return found


def _packages_below(folder: Path) -> Iterator[Path]:
    waiting = deque([(folder, 0)])
    seen = 0
    while waiting and seen < MOST_FOLDERS:
        current, depth = waiting.popleft()
        seen += 1
        if (current / "package.xml").is_file():
            yield current
            continue
        try:
            with os.scandir(current) as entries:
                inside = sorted(entries, key=lambda entry: entry.name)
            if depth < LEVELS_BELOW and not any(entry.name in _IGNORED for entry in inside):
                below = [entry for entry in inside if not entry.name.startswith(".") and entry.is_dir()]
                waiting.extend((Path(entry.path), depth + 1) for entry in below)
        except OSError:
            continue
