"""The description of a robot as a robot file names it: packages, missing meshes and inertials."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import listed, number_of
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.examine import examine
from manipcli.description.packages import NotFound, Packages, may_name, own_root
from manipcli.description.urdf.link import MISSING_VISUAL
from manipcli.description.urdf.urdf import Parts
from manipcli.model.build_robot import build_robot
from manipcli.model.inertials import massless_bodies
from manipcli.model.robot import RobotModel
from manipcli.onboard.writer import Entry, plain
from manipcli.spec.inertials import WATER
from manipcli.spec.load import read_bytes
from manipcli.spec.robot import RobotSpec
from manipcli.spec.source.tree import Plain

TOO_HEAVY: Final = "URDF112"
"""Code of the check for links that are denser than any metal."""
GENERIC = ("robot", "model", "urdf", "description")
"""Names of files that do not name a robot."""


@dataclass(frozen=True, slots=True)
class Source:
    """A readable description.

    Attributes:
        name: of the robot.
        robot: as described, at the world's origin.
        path: of the description.
        entries: of the robot file, up to `collision`; `description` and `packages` as the project's folder names them.
        anywhere: the same for a robot file in any folder.
        notes: for the user.
    """

    name: str
    robot: RobotModel
    path: Path
    entries: Mapping[str, Entry]
    anywhere: Mapping[str, Entry]
    notes: tuple[str, ...]


def read_source(
    description: str,
    arguments: Mapping[str, str],
    folder: Path,
    *,
    package_path: tuple[Path, ...],
    allow_outside: bool,
) -> Source:
    """Reads a description, and mends by the robot file what it can mend.

    Args:
        description: a path, or `package://NAME/...`.
        arguments: of the xacro file.
        folder: of the project.
        package_path, allow_outside: see `build_robot`.

    Raises:
        InvalidInput: what no robot file mends.
    """
    path = _located(description, package_path)
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    checked = tuple(check for check in CHECKS if check.severity == "error" or check.code == TOO_HEAVY)
    examination = examine(path, packages=packages, arguments=arguments, checks=checked)
    parts = examination.parts
    if parts is None:
        raise InvalidInput(examination.findings)
    if parts.root and not any(joint.independent for joint in parts.joints):
        message = f"no joint of '{path.name}' moves: there is nothing to command"
        raise InvalidInput([Diagnostic("INIT002", message, Place(str(path), 0, 0))])
    name = parts.name if path.name.partition(".")[0] in GENERIC and parts.name else path.name.partition(".")[0]
    mended, notes = _mended(parts, examination.findings)
    outer = _outer_packages(path, packages, allow_outside)
    root = own_root(folder / "robot.yaml") or Path(os.path.realpath(folder))
    notes += [
        f"package '{name}' is outside the project and has no package.xml: commands need --allow-outside, or "
        f"--package-path {shlex.quote(str(place.parent))}, or copy it into the project"
        for name, place in outer.items()
        if not may_name(place, name, root)
    ]
    spec = RobotSpec.model_validate(
        {
            "robot": name,
            "description": str(path),
            "args": dict(arguments),
            **{key: plain(entry) for key, entry in mended.items()},
        }
    )
    robot, findings = build_robot(
        spec, file=folder / "robot.yaml", package_path=package_path, allow_outside=allow_outside
    )
    warned = sum(finding.severity == "warning" for finding in findings)
    if warned:
        notes.append(
            f"the description has {number_of(warned, 'warning')}: `manipcli check-urdf` of the file lists them"
        )
    head = {"robot": Entry(name)}
    tail = ({"args": Entry(dict(arguments))} if arguments else {}) | mended
    return Source(
        name,
        robot,
        path,
        head | _placed(description, path, outer, folder) | tail,
        head | {"description": Entry(str(path))} | tail,
        tuple(notes),
    )


def _located(description: str, package_path: tuple[Path, ...]) -> Path:
    """The file of the description.

    Raises:
        InvalidInput: there is none.
    """
    if "://" not in description:
        read_bytes(Path(description))  # the usual error for a missing file
        return Path(os.path.realpath(description))
    try:
        return Packages(None, package_path=package_path).resolve(description, anywhere=True)
    except NotFound as error:
        raise InvalidInput([Diagnostic("USE101", error.message, hint=error.hint)]) from error


def _outer_packages(path: Path, packages: Packages, allow_outside: bool) -> dict[str, Path]:
    """The packages that are only found with `--package-path`."""
    alone = Packages(path, allow_outside=allow_outside)
    found = {}
    for name, folder in packages.found.items():
        try:
            same = alone.root(name) == folder
        except NotFound:
            same = False
        if not same:
            found[name] = folder
    return found


def _placed(description: str, path: Path, outer: Mapping[str, Path], folder: Path) -> dict[str, Entry]:
    """`description` and `packages` for a robot file in the folder."""
    here = os.path.realpath(folder)
    relative = description if "://" in description else os.path.relpath(path, here)
    portable = Packages(path).portable(path)
    if relative.startswith("..") and portable.startswith("package://"):
        try:
            if Packages(None).resolve(portable) == path:
                relative = portable  # an installed package: the same on another machine
        except NotFound:
            pass
    found = {"description": Entry(relative)}
    if outer:
        rows: dict[str, Plain] = {name: os.path.relpath(root, here) for name, root in sorted(outer.items())}
        found["packages"] = Entry(rows, "as given by --package-path")
    return found


def _mended(parts: Parts, findings: Sequence[Diagnostic]) -> tuple[dict[str, Entry], list[str]]:
    """`inertials` and `collision` of the robot file, where the description lacks something."""
    found: dict[str, Entry] = {}
    notes: list[str] = []
    unusable = [link.name for link in parts.links if link.unusable is not None]
    massive = {link.name for link in parts.links if link.inertial is not None}
    massless = sorted(massless_bodies(parts.joints, massive))
    heavy = [
        name for name in _named(finding for finding in findings if finding.code == TOO_HEAVY) if name not in unusable
    ]
    if unusable or massless or heavy:
        lacking = list(dict.fromkeys((*unusable, *massless, *heavy)))
        why = f"missing or impossible in the description: {listed(lacking, most=6)}; from the volume of their shapes"
        estimate: Plain = "estimate"
        if heavy:
            estimate = {"estimate": {}, "links": {name: {"density": WATER} for name in heavy}}
            why = why.replace(";", ", or denser than any metal;", 1)
        found["inertials"] = Entry(estimate, f"{why}, as heavy as water", True)
        notes.append(
            f"inertials of {number_of(len(lacking), 'link')} are estimated; `manipcli check robot.yaml` shows the table"
        )
    missing = [link for link in parts.links if link.missing]
    if missing:
        rows: dict[str, Plain] = {link.name: "from_visual" if link.visuals else "none" for link in missing}
        bare = [name for name, how in rows.items() if how == "none"]
        why = "collision meshes that are not found are replaced by the visual shapes"
        if bare:
            why += f", or by none: {listed(bare)} without contacts"
        found["collision"] = Entry(rows, why, True)
        lost = sorted({*_named(finding for link in missing for finding in link.missing)})
        unseen = {*_named(finding for finding in findings if finding.code == MISSING_VISUAL)}
        partial = [
            link.name
            for link in missing
            if rows[link.name] == "from_visual" and unseen.intersection(_named(link.missing))
        ]
        notes.append(
            f"{len(lost)} of its collision meshes are not found or unusable: {listed(lost, most=6)}; add them (where: "
            "`manipcli check-urdf` of the file) or name their package by --package-path, and repeat with --force"
        )
        if partial:
            notes.append(
                f"{number_of(len(partial), 'link')} with a part of the shapes alone, as visual meshes are not found "
                f"either: {listed(partial, most=6)}"
            )
        if bare:
            notes.append(
                f"{number_of(len(bare), 'link')} without any shape, which planning and physics do not see: "
                f"{listed(bare, most=6)}"
            )
    return found, notes


def _named(findings: Iterable[Diagnostic]) -> Iterator[str]:
    """What these findings name first: files, or links."""
    for finding in findings:
        yield finding.message.partition("'")[2].partition("'")[0]
