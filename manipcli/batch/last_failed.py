"""Which cases did not pass the last time they were run: a small JSON file beside the logs of tests."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from manipcli.core.whole_file import write_whole
from manipcli.report.suite import CaseReport

NAME = "last_failed.json"


def last_failed(folder: Path) -> frozenset[str]:
    """Ids of cases; none where nothing is known."""
    try:
        known = json.loads((folder / NAME).read_text("utf-8"))
    except (OSError, ValueError):
        return frozenset()
    return frozenset(one for one in known if isinstance(one, str)) if isinstance(known, list) else frozenset()


def remember(folder: Path, reports: Iterable[CaseReport]) -> None:
    """Cases that were not run now keep what was known of them.

    Raises:
        OSError: the folder cannot be written to.
    """
    done = list(reports)
    failed = last_failed(folder) - {one.case.id for one in done} | {one.case.id for one in done if not one.passed}
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / NAME, (json.dumps(sorted(failed), indent=1) + "\n").encode())
