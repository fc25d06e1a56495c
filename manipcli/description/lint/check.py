"""The check seam: one member per kind of defect in a robot description."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from manipcli.core.errors import Diagnostic, Severity
from manipcli.description.expanded import Description
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import Parts

Tier = Literal["schema", "topology", "physics", "assets", "readiness"]
"""Area of a check, from the XML text to simulation readiness."""


@dataclass(frozen=True, slots=True)
class Subject:
    """A description that is being checked.

    Attributes:
        description: the expanded tree; every element has its place in the source file.
        parts: links, joints and transmissions as far as they could be read, with the reader's findings.
        packages: resolves the packages and files that the description names.
    """

    description: Description
    parts: Parts
    packages: Packages


Find = Callable[[Subject], Iterable[Diagnostic]]


@dataclass(frozen=True, slots=True)
class Check:
    """A check of descriptions.

    Attributes:
        code: stable, `URDF031`.
        name: one or a few words, joined by `-`, for tables.
        tier: the area that it checks.
        severity: highest severity of its findings. Loading a robot runs only the checks of severity `error`.
        summary: the defect, in one line without values.
        reason: what a simulator or planner does with the defect; printed by `--explain`.
        bad: a complete description (URDF or xacro text) with exactly this defect.
        find: yields every occurrence in a subject.
        files: creates the files that `bad` refers to, by path relative to it.
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
    """Decorator: makes a `Check` of a finder function, whose docstring is the summary, a blank line and the reason."""

    def made(find: Find) -> Check:
        summary, _, reason = (find.__doc__ or "").partition("\n\n")
        return Check(
            code, name, tier, severity, summary.strip().removesuffix("."), " ".join(reason.split()), bad, find, files
        )

    return made


def found_while_reading(code: str) -> Find:
    """The findings with this code that `read_parts` reported."""
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
    """A check whose findings the reader reports; `functools.partial` binds the tier."""
    return Check(code, name, tier, severity, summary, reason, bad, found_while_reading(code), files)
