"""A task or a log that cannot be used, to what a run would have been told by: a verdict, and the page about it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from manipcli.core.errors import Diagnostic, Place
from manipcli.core.version import __version__
from manipcli.judge.verdict import Verdict
from manipcli.report.run_page import Cause, RunPage, Source, Written

LARGEST = 1_000_000
"""Bytes of a file that is shown."""
SHOWN = 8
"""Files that are shown."""


def invalid_verdict(file: Path, findings: Sequence[Diagnostic]) -> Verdict:
    """What there is to say without a run. The engine is "": nothing is known of it."""
    errors = tuple(one for one in findings if one.severity == "error")
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
    """The page: each error with its place, and the files that these are in, as written. `log`: the name of a log."""
    sources = tuple(_sources(one.place for one in verdict.errors))
    lines = {source.name: len(source.text.splitlines()) for source in sources}
    return RunPage(
        verdict=verdict,
        causes=tuple(
            Cause(one.message, "", written=_written(one.place, lines), hint=one.hint or "") for one in verdict.errors
        ),
        log=log,
        sources=sources,
        provenance=(("manipcli", __version__), ("log", log) if log else ("run", "nothing was run")),
        warnings=tuple(one for one in findings if one.severity == "warning"),
        notes=tuple(str(one) for one in findings if one.severity == "note"),
    )


def _written(place: Place | None, lines: Mapping[str, int]) -> Written | None:
    """A link where that line is shown: a YAML error may be behind the last."""
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
            continue  # the error tells what is wrong with it
