"""Result of re-simulating a log (`replay --verify`), as text and JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.core.errors import Diagnostic
from manipcli.core.text import number_of
from manipcli.record.foreign.compare import Comparison
from manipcli.record.read.compare_entries import EntryDifference
from manipcli.report.json import dumps, number, plain
from manipcli.report.logs.comparison import (
    Names,
    counted,
    entries_lines,
    first_text,
    messages_object,
    topics_table,
)
from manipcli.report.text import FAIL, PASS

_NAMES: Names = ("in the log", "in the re-run")


@dataclass(frozen=True, slots=True)
class Verification:
    """Comparison of a log with its re-simulation.

    Attributes:
        log: path of the log.
        versions: versions that re-simulated it.
        messages: comparison of all topics; `a` is the log, `b` the re-run.
        entries: metadata and attachments that differ.
        unlike: versions and meshes that differ from those of the run.
        cut: why the log is incomplete; it is compared up to its end. "" for a complete log.
        wall_time: wall time of the verification [s].
    """

    log: str
    versions: Mapping[str, str]
    messages: Comparison
    entries: tuple[EntryDifference, ...]
    unlike: tuple[Diagnostic, ...]
    cut: str
    wall_time: float

    @property
    def identical(self) -> bool:
        """Whether the re-run is identical to the log."""
        return self.messages.same and not self.entries


def render_text(result: Verification) -> str:
    """First difference, differing topics and entries, and the result."""
    lines = []
    first = result.messages.first
    if first is not None:
        lines += [f"{FAIL} first difference: {first_text(first, _NAMES)}", ""]
    if not result.messages.same:
        lines.append(topics_table(result.messages.topics, _NAMES))
    lines += [f"{FAIL} {line}" for line in entries_lines(result.entries, _NAMES)]
    lines += [""] if lines else []
    lines += [f"differs from the run: {finding.message}" for finding in result.unlike]
    if result.cut:
        lines.append(f"the log is incomplete and compared up to its end: {result.cut}")
    topics = sum(1 for topic in result.messages.topics if topic.messages[0])
    held = (
        f"{number_of(result.messages.messages, 'message')} of {number_of(topics, 'topic')}, {result.messages.end:.2f} s"
    )
    if result.identical:
        lines.append(f"{PASS} identical: {held}{'' if result.cut else ', and all metadata and attachments'}")
    else:
        lines.append(f"{FAIL} different: {counted(result.messages)}; the log has {held}")
    by = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    lines.append(f"re-simulated with {by} in {result.wall_time:.2f} s")
    return "\n".join([*lines, f"log: {result.log}"])


def render_json(result: Verification) -> str:
    """The result as one JSON object."""
    return dumps(
        {
            "log": result.log,
            "identical": result.identical,
            "complete": not result.cut,
            "cut": result.cut or None,
            "versions": dict(result.versions),
            "unlike": plain(result.unlike),
            **messages_object(result.messages),
            "entries": plain(result.entries),
            "wall_time": number(result.wall_time),
        }
    )
