"""The contract of checks: what can be wrong with a description, one member a kind of defect."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from manipcli.core.errors import Diagnostic, Severity
from manipcli.description.description import Description
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import Parts

Tier = Literal["schema", "topology", "physics", "assets", "readiness"]
"""What a defect is about, from the text to the simulation."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A description under examination.

    Attributes:
        description: its expanded tree; every element knows where the user wrote it.
        parts: links, joints and transmissions as far as they could be read, with the findings of reading.
        packages: resolves what it names.
    """

    description: Description
    parts: Parts
    packages: Packages


Find = Callable[[Subject], Iterable[Diagnostic]]


@dataclass(frozen=True, slots=True)
class Check:
    """A member of the seam.

    Attributes:
        code: stable, `URDF031`.
        name: one or a few words, joined by `-`, for tables.
        tier: what it is about.
        severity: of its findings, unless one says otherwise; none is graver. Loading makes the checks of errors.
        summary: what is wrong, in one line without values.
        reason: why it matters: what a simulator or planner does with it. For `--explain`.
        bad: a whole description (URDF or xacro text) that has exactly this defect.
        find: every occurrence in a subject.
        files: what `bad` names besides, by path relative to it, made when it is asked for.
    """

    code: str
    name: str
    tier: Tier
    severity: Severity
    summary: str
    reason: str
    bad: str
    find: Find
    files: Callable[[], Mapping[str, bytes]] = dict[str, bytes]


def check(
    code: str,
    name: str,
    tier: Tier,
    severity: Severity = "error",
    *,
    bad: str,
    files: Callable[[], Mapping[str, bytes]] = dict[str, bytes],
) -> Callable[[Find], Check]:
    """Makes the check of a function that finds. Its docstring is the summary, then the reason."""

    def made(find: Find) -> Check:
        summary, _, reason = (find.__doc__ or "").partition("\n\n")
        return Check(
            code, name, tier, severity, summary.strip().removesuffix("."), " ".join(reason.split()), bad, find, files
        )

    return made


def found_while_reading(code: str) -> Find:
    """The findings of this code that reading the description made: the one door every description comes through."""
    return lambda subject: (finding for finding in subject.parts.findings if finding.code == code)


def reading_check(
    tier: Tier,
    code: str,
    name: str,
    summary: str,
    reason: str,
    bad: str,
    *,
    severity: Severity = "error",
    files: Callable[[], Mapping[str, bytes]] = dict[str, bytes],
) -> Check:
    """A check that reading makes anyway; a file of them binds the tier first."""
    return Check(code, name, tier, severity, summary, reason, bad, found_while_reading(code), files)
