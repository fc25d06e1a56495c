"""Verdict and page for a task or log that is invalid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from manipcli.core.errors import Diagnostic, Place
from manipcli.core.version import __version__
from manipcli.judge.verdict import Verdict
from manipcli.replay.cause import Cause, Written
from manipcli.report.run_page import RunPage, Source

LARGEST = 1_000_000
"""Largest file that the page shows [byte]."""
SHOWN = 8
"""Most files that the page shows."""


def invalid_verdict(file: Path, findings: Sequence[Diagnostic]) -> Verdict:
    """The verdict `error` of a file that cannot be run or judged; its engine is "", since it is unknown."""
    errors = tuple(finding for finding in findings if finding.severity == "error")
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    return Verdict(
        task=file.name,
        verdict="error",
        seed=0,
        engine="",
        simulated_time=0.0,
        steps=(),
        expectations=(),
        errors=errors,
        text=f"{errors[0].message}{more}" if errors else "",
    )


def invalid_page(verdict: Verdict, findings: Sequence[Diagnostic], *, log: str = "") -> RunPage:
    """The page with each error, its place and the files as written; `log` is the name of a log or ""."""
    sources = tuple(_sources(error.place for error in verdict.errors))
    lines = {source.name: len(source.text.splitlines()) for source in sources}
    return RunPage(
        verdict=verdict,
        causes=tuple(
            Cause(error.message, "", written=_written(error.place, lines), hint=error.hint or "")
            for error in verdict.errors
        ),
        log=log,
        sources=sources,
        provenance=(("manipcli", __version__), ("log", log) if log else ("run", "nothing was run")),
        warnings=tuple(finding for finding in findings if finding.severity == "warning"),
        notes=tuple(str(finding) for finding in findings if finding.severity == "note"),
    )


def _written(place: Place | None, lines: Mapping[str, int]) -> Written | None:
    """A link to the line if it is shown; a YAML error can be after the last line."""
    if place is None:
        return None
    return Written(str(place), place.file, place.line if place.line <= lines.get(place.file, 0) else 0)


def _sources(places: Iterable[Place | None]) -> Iterable[Source]:
    names = dict.fromkeys(place.file for place in places if place is not None and place.line > 0)
    for name in list(names)[:SHOWN]:
        path = Path(name)
        try:
            if path.is_file() and path.stat().st_size <= LARGEST:
                yield Source(name, path.read_text("utf-8", "replace"))
        except OSError:
            continue  # the error already reports why
