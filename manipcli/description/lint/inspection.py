"""A description examined and summed up: what `check-urdf` asks."""

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
"""Ends of the names of descriptions; other files are YAML."""


@dataclass(frozen=True, slots=True)
class Inspection:
    """`summary` and `tree` (lines) are None and empty where the file could not be read or expanded."""

    path: Path
    examination: Examination
    summary: Summary | None
    tree: tuple[str, ...]

    def told(self, codes: Collection[str]) -> tuple[Diagnostic, ...]:
        """The findings of these codes; all of them where the file could not be read: that cannot be ignored."""
        findings = self.examination.findings
        if self.examination.parts is None:
            return findings
        return tuple(finding for finding in findings if finding.code in codes)


def located(word: str, *, package_path: Sequence[Path] = ()) -> Path:
    """The file that a user names: by its path, or `package://NAME/...`, found as from a robot file in this folder.

    Raises:
        InvalidInput: the package is not found, or the file is not in it.
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
    """Everything that can be said about a description; see `examine`.

    Raises:
        InvalidInput: there is no such file, or a bound of the user's own is none. Whatever a file holds is told in
            findings.
    """
    bounds()
    if not os.path.lexists(path):
        raise InvalidInput([Diagnostic("USE101", "there is no such file", Place(str(path), 0, 0), hint=sibling(path))])
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    examination = examine(path, packages=packages, arguments=arguments, allow_env=allow_env)
    if examination.description is None or examination.parts is None:
        return Inspection(path, examination, None, ())
    summary = summarise(examination.description, examination.parts)
    return Inspection(path, examination, summary, tree_lines(examination.parts))


def wanted_codes(select: Sequence[str], ignore: Sequence[str]) -> frozenset[str]:
    """The codes to tell: those that `select` names (all when it is empty), less those that `ignore` names.

    A word is a code, the beginning of codes, a tier, or the name of a check.

    Raises:
        InvalidInput: a word names no check.
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
    """The check of a code, or of a name.

    Raises:
        InvalidInput: there is none.
    """
    for check in CHECKS:
        if code.upper() == check.code or code.lower() == check.name:
            return check
    raise InvalidInput([_unknown(code)])


def _unknown(word: str) -> Diagnostic:
    hint = did_you_mean(word[:40].upper(), [check.code for check in CHECKS], kind="codes")
    return Diagnostic("USE046", f"no check has the code '{shorten(word)}'", hint=f"{hint}; `manipcli list checks`")


def mend(inspection: Inspection, *, in_place: bool, force: bool = False) -> tuple[Path, tuple[Change, ...]]:
    """Writes the mended file: `NAME.fixed.urdf` beside it, or the file itself; nothing where nothing is to mend.

    Args:
        in_place: the file itself.
        force: replace another file that is there.

    Returns:
        The mended file, and what was changed.

    Raises:
        InvalidInput: it is xacro, it could not be read, it is not UTF-8, or another file is in the way.
    """
    path, description = inspection.path, inspection.examination.description
    if description is None:
        raise InvalidInput(
            [
                *inspection.examination.findings,
                Diagnostic("USE047", f"'{path}' cannot be read: there is nothing to mend"),
            ]
        )
    if description.expanded:
        message = f"'{path}' is xacro: what is mended there may be wrong where a macro is called elsewhere"
        raise InvalidInput([Diagnostic("USE047", message, hint="mend it by hand; each finding says where")])
    data, changes = mended(path, description)
    target = path if in_place else path.with_name(f"{path.name.removesuffix('.urdf')}.fixed.urdf")
    if changes:
        if not (in_place or force) and target.exists() and not _same(target, data):
            message = f"'{target}' is there already, and is not what would be written"
            raise InvalidInput([Diagnostic("USE084", message, hint="--force replaces it")])
        partial = target.with_name(f".{target.name}.{os.getpid()}.partial")
        partial.write_bytes(data)
        if in_place:
            shutil.copymode(path, partial)
        partial.replace(target)
    return target, changes


def _same(path: Path, data: bytes) -> bool:
    return path.is_file() and path.stat().st_size == len(data) and path.read_bytes() == data
