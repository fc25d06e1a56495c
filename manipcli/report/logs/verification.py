"""A log that was simulated again: what came of it, for people and for programs."""

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

_NAMES: Names = ("in the log", "again")


@dataclass(frozen=True, slots=True)
class Verification:
    """What came of simulating a log again.

    Attributes:
        log: its path.
        versions: of what simulated it again.
        messages: of all topics of the log and of the second one; `a` is the log.
        entries: metadata and attachments that differ.
        unlike: versions and meshes that are not those of the run.
        cut: why the log does not go to the end of its run; until then it is compared. "" where it does.
        wall_time: [s].
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
        """Whether everything in the log came out again."""
        return self.messages.same and not self.entries


def render_text(made: Verification) -> str:
    """What differs first, then where, then the verdict."""
    lines = []
    first = made.messages.first
    if first is not None:
        lines += [f"{FAIL} first difference: {first_text(first, _NAMES)}", ""]
    if not made.messages.same:
        lines.append(topics_table(made.messages.topics, _NAMES))
    lines += [f"{FAIL} {line}" for line in entries_lines(made.entries, _NAMES)]
    lines += [""] if lines else []
    lines += [f"not as it was in the run: {finding.message}" for finding in made.unlike]
    if made.cut:
        lines.append(f"the log does not go to the end of its run, and is compared as far as it goes: {made.cut}")
    topics = sum(1 for topic in made.messages.topics if topic.messages[0])
    held = f"{number_of(made.messages.messages, 'message')} of {number_of(topics, 'topic')}, {made.messages.end:.2f} s"
    if made.identical:
        lines.append(f"{PASS} identical: {held}{'' if made.cut else ', and all metadata and attachments'}")
    else:
        lines.append(f"{FAIL} different: {counted(made.messages)}; the log has {held}")
    by = ", ".join(f"{name} {version}" for name, version in made.versions.items())
    lines.append(f"simulated again by {by}, in {made.wall_time:.2f} s")
    return "\n".join([*lines, f"log: {made.log}"])


def render_json(made: Verification) -> str:
    """The same as one object."""
    return dumps(
        {
            "log": made.log,
            "identical": made.identical,
            "complete": not made.cut,
            "cut": made.cut or None,
            "versions": dict(made.versions),
            "unlike": plain(made.unlike),
            **messages_object(made.messages),
            "entries": plain(made.entries),
            "wall_time": number(made.wall_time),
        }
    )
