"""What a user reads after a robot was set up: what was found, what to check, and what the first task does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from manipcli.onboard.first_task import FirstTask
from manipcli.report.table import table
from manipcli.report.text import FAIL, PASS


def summary(
    *, found: Sequence[str], checks: Sequence[tuple[str, str]], notes: Sequence[str], task: FirstTask
) -> Iterator[str]:
    """The lines.

    Args:
        found: what was measured.
        checks: (path, evidence) of values that are only plausible.
        notes: for the user.
        task: the first task.
    """
    yield from found
    if checks:
        yield ""
        yield "please check (CHECK in the files):"
        yield from (f"  {', '.join(paths)}: {why}" for paths, why in _alike(checks))
    if notes:
        yield ""
        yield from (f"note: {note}" for note in notes)
    yield ""
    marks = {"passed": f"{PASS} passed", "failed": f"{FAIL} failed", "not tried": "- not tried"}
    rows = [(ability.what, marks[ability.shown], ability.why) for ability in task.abilities]
    yield table(("the robot", "shown", "evidence"), rows)
    yield ""
    if task.passed:
        yield f"{PASS} first task: {task.does}; its run passed"
    else:
        held = any(ability.shown == "passed" for ability in task.abilities)
        yield f"{FAIL} first task: {task.does}; {'no run showed more' if held else 'no run passed'}"


def _alike(checks: Sequence[tuple[str, str]]) -> list[tuple[list[str], str]]:
    """Paths with the same evidence, which is written at the first one alone."""
    found: list[tuple[list[str], str]] = []
    for path, why in checks:
        if found and why in ("", found[-1][1]):
            found[-1][0].append(path)
        else:
            found.append(([path], why))
    return found
