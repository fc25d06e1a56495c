"""Reading of a description and execution of every check; each defect becomes a finding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput, Place, Severity
from manipcli.description.expanded import Description, read_description
from manipcli.description.lint.check import Check, Subject
from manipcli.description.lint.checks import CHECKS
from manipcli.description.located_xml import shown_path
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import Parts, read_parts

MOST_OF_A_CODE: Final = 100
MOST: Final = 1000
_RANK: Final[dict[Severity, int]] = {"error": 0, "warning": 1, "note": 2}


@dataclass(frozen=True, slots=True)
class Examination:
    """The findings about a description.

    Attributes:
        findings: in the order of files and lines; at most `MOST_OF_A_CODE` per code and `MOST` in all.
        left_out: number of further findings per code, ((code, number), ...); one check reports at most `MOST`.
        description: the expanded tree; None if the file is not XML, not a description or cannot be expanded.
        parts: links, joints and transmissions as far as they could be read; None without a tree.
    """

    findings: tuple[Diagnostic, ...]
    left_out: tuple[tuple[str, int], ...]
    description: Description | None
    parts: Parts | None

    @property
    def errors(self) -> tuple[Diagnostic, ...]:
        return tuple(finding for finding in self.findings if finding.severity == "error")


def examine(
    path: Path,
    *,
    packages: Packages,
    arguments: Mapping[str, str | int | float | bool] = {},
    allow_env: Collection[str] = (),
    checks: Iterable[Check] = CHECKS,
) -> Examination:
    """Reads a description and runs the checks. Never raises, whatever the file contains.

    Args:
        path: URDF or xacro.
        packages: finds the packages and files it names.
        arguments: for `<xacro:arg>`.
        allow_env: environment variables that `$(env NAME)` and `$(optenv NAME)` may read.
        checks: the checks to run; findings of the reader are always included.
    """
    try:
        description = read_description(path, packages=packages, arguments=arguments, allow_env=allow_env)
        parts = read_parts(description)
    except InvalidInput as error:
        return _examination(error.findings, None, None)
    except (RecursionError, MemoryError):
        message = "the description is nested too deeply or too large for this machine; no bound changes this"
        return _examination([Diagnostic("URDF052", message, Place(shown_path(path), 0, 0))], None, None)
    subject = Subject(description, parts, packages)
    found = list(parts.findings)
    for check in checks:
        found += _run(check, subject)
    return _examination(found, description, parts)


def _run(check: Check, subject: Subject) -> list[Diagnostic]:
    found: list[Diagnostic] = []
    try:
        found.extend(islice(check.find(subject), MOST))
    except InvalidInput as error:
        found += error.findings
    except Exception as error:  # noqa: BLE001  (a check that breaks must not let the file pass)
        message = f"check '{check.name}' failed with an internal error: {type(error).__name__}: {error}"
        found.append(Diagnostic(check.code, message.replace("\n", " "), severity="error"))
    return found


def _examination(found: Iterable[Diagnostic], description: Description | None, parts: Parts | None) -> Examination:
    """Each finding once, in the order of the file, up to the limits; errors take precedence."""
    unique = list({(finding.code, finding.message, finding.place): finding for finding in found}.values())
    kept: list[Diagnostic] = []
    of_code: Counter[str] = Counter()
    for finding in sorted(unique, key=lambda each: _RANK[each.severity]):
        of_code[finding.code] += 1
        if of_code[finding.code] <= MOST_OF_A_CODE and len(kept) < MOST:
            kept.append(finding)
    shown = Counter(finding.code for finding in kept)
    left_out = tuple((code, number - shown[code]) for code, number in sorted(of_code.items()) if number > shown[code])
    main = str(description.root.place.file) if description is not None and description.root.place is not None else ""
    kept.sort(key=lambda finding: _order(finding, main))
    return Examination(tuple(kept), left_out, description, parts)


def _order(finding: Diagnostic, main: str) -> tuple[bool, bool, str, int, int, int, str]:
    """Findings without a place come first, then those in the file itself, then those in the files it includes."""
    place = finding.place
    rank = _RANK[finding.severity]
    if place is None:
        return (False, False, "", 0, 0, rank, finding.code)
    return (True, place.file != main, place.file, place.line, place.column, rank, finding.code)
