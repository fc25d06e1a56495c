"""Examination and summary of a description: the library side of `check-urdf`."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import did_you_mean, shorten
from manipcli.description.bounds import bounds
from manipcli.description.lint.check import Check
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.examine import Examination, examine
from manipcli.description.lint.fix import Change, mended
from manipcli.description.lint.summary import Summary, summarise, tree_lines
from manipcli.description.packages import NotFound, Packages
from manipcli.spec.load import sibling

DESCRIPTIONS = (".urdf", ".xacro", ".xml")
"""Suffixes of description files; other files are YAML."""


@dataclass(frozen=True, slots=True)
class Inspection:
    """`summary` is None and `tree` (lines) is empty if the file could not be read or expanded."""

    path: Path
    examination: Examination
    summary: Summary | None
    tree: tuple[str, ...]

    def reported(self, codes: Collection[str]) -> tuple[Diagnostic, ...]:
        """The findings with these codes; all findings if the file could not be read."""
        findings = self.examination.findings
        if self.examination.parts is None:
            return findings
        return tuple(finding for finding in findings if finding.code in codes)


def located(word: str, *, package_path: Sequence[Path] = ()) -> Path:
    """The file that a user names: a path, or `package://NAME/...` as seen from the working directory.

    Raises:
        InvalidInput: the package or the file is not found.
    """
    if not word.startswith(("package://", "model://")):
        return Path(word)
    try:
        return Packages(Path("robot.yaml"), package_path=package_path).resolve(word)
    except NotFound as error:
        raise InvalidInput([Diagnostic("USE101", error.message, hint=error.hint)]) from error


def inspect(
    path: Path,
    *,
    arguments: Mapping[str, str] = {},
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    allow_env: Collection[str] = (),
) -> Inspection:
    """Findings, summary and tree of a description; see `examine`.

    Raises:
        InvalidInput: the file does not exist, or MANIPCLI_BOUNDS is invalid. Errors inside the file are findings.
    """
    bounds()
    if not os.path.lexists(path):
        raise InvalidInput(
            [Diagnostic("USE101", "the file does not exist", Place(str(path), 0, 0), hint=sibling(path))]
        )
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    examination = examine(path, packages=packages, arguments=arguments, allow_env=allow_env)
    if examination.description is None or examination.parts is None:
        return Inspection(path, examination, None, ())
    summary = summarise(examination.description, examination.parts)
    return Inspection(path, examination, summary, tree_lines(examination.parts))


def wanted_codes(select: Sequence[str], ignore: Sequence[str]) -> frozenset[str]:
    """The codes to report: those that `select` names (all if it is empty), minus those that `ignore` names.

    A word is a code, a code prefix, a tier, or the name of a check.

    Raises:
        InvalidInput: a word matches none of the checks.
    """
    chosen = _named(select) if select else {check.code for check in CHECKS}
    return frozenset(chosen - _named(ignore))


def _named(words: Sequence[str]) -> set[str]:
    found: set[str] = set()
    for word in words:
        named = {
            check.code
            for check in CHECKS
            if word and (check.code.startswith(word.upper()) or word.lower() in (check.tier, check.name))
        }
        if not named:
            raise InvalidInput([_unknown(word)])
        found |= named
    return found


def explained(code: str) -> Check:
    """The check with a code or name.

    Raises:
        InvalidInput: unknown code or name.
    """
    for check in CHECKS:
        if code.upper() == check.code or code.lower() == check.name:
            return check
    raise InvalidInput([_unknown(code)])


def _unknown(word: str) -> Diagnostic:
    hint = did_you_mean(word[:40].upper(), [check.code for check in CHECKS], kind="codes")
    return Diagnostic("USE046", f"unknown check code '{shorten(word)}'", hint=f"{hint}; `manipcli list checks`")


def mend(inspection: Inspection, *, in_place: bool, force: bool = False) -> tuple[Path, tuple[Change, ...]]:
    """Writes the fixed file: `NAME.fixed.urdf` beside it, or the file itself; nothing if there is nothing to fix.

    Args:
        in_place: overwrite the file itself.
        force: overwrite an existing `NAME.fixed.urdf`.

    Returns:
        The fixed file, and the changes.

    Raises:
        InvalidInput: it is xacro, it cannot be read, it is not UTF-8, or `NAME.fixed.urdf` exists.
    """
    path, description = inspection.path, inspection.examination.description
    if description is None:
        raise InvalidInput(
            [
                *inspection.examination.findings,
                Diagnostic("USE047", f"'{path}' cannot be fixed: it cannot be read"),
            ]
        )
    if description.expanded:
        message = f"'{path}' is xacro and cannot be fixed automatically: a macro may be called in several places"
        raise InvalidInput([Diagnostic("USE047", message, hint="fix it by hand at the place of each finding")])
    data, changes = mended(path, description)
    target = path if in_place else path.with_name(f"{path.name.removesuffix('.urdf')}.fixed.urdf")
    if changes:
        if not (in_place or force) and target.exists() and not _same(target, data):
            message = f"'{target}' exists already and differs"
            raise InvalidInput([Diagnostic("USE084", message, hint="overwrite it with --force")])
        partial = target.with_name(f".{target.name}.{os.getpid()}.partial")
        partial.write_bytes(data)
        if in_place:
            shutil.copymode(path, partial)
        partial.replace(target)
    return target, changes


def _same(path: Path, data: bytes) -> bool:
    return path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data
