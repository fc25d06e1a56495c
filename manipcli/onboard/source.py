"""The description of a robot as a robot file names it: packages, missing meshes and inertials."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import listed, number_of
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.examine import examine
from manipcli.description.packages import NotFound, Packages, may_name, own_root
from manipcli.description.urdf.link import MISSING_VISUAL
from manipcli.description.urdf.urdf import Parts
from manipcli.model.build_robot import bare_robot, build_robot, is_mount, without_root
from manipcli.model.hand.parts import guess_parts
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.inertials import massless_bodies
from manipcli.model.kinematics import Kinematics
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


@dataclass(frozen=True, slots=True)
class HandSource:
    """A hand of another description.

    Attributes:
        description: a path, or `package://NAME/...`.
        arguments: of the xacro file.
        parent: link of the arm that carries it. Default: the last link of the arm.
        pose: of its root in the parent: x, y, z [m], and roll, pitch, yaw [rad] if it is rotated. Default: identity.
    """

    description: str
    arguments: Mapping[str, str]
    parent: str | None = None
    pose: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class _Read:
    """A description that was read; `prefix`: of its names in the robot."""

    path: Path
    packages: Packages
    parts: Parts
    findings: tuple[Diagnostic, ...]
    prefix: str = ""

    @property
    def name(self) -> str:
        """That of the file, or of the robot in it."""
        stem = self.path.name.partition(".")[0]
        return self.parts.name if stem in GENERIC and self.parts.name else stem


def read_source(
    description: str,
    arguments: Mapping[str, str],
    folder: Path,
    *,
    package_path: tuple[Path, ...],
    allow_outside: bool,
    hand: HandSource | None = None,
) -> Source:
    """Reads a description, and mends by the robot file what it can mend.

    Args:
        description: a path, or `package://NAME/...`.
        arguments: of the xacro file.
        folder: of the project.
        package_path, allow_outside: see `build_robot`.
        hand: a hand from another description, to attach.

    Raises:
        InvalidInput: what no robot file mends.
    """
    arm = _read(description, arguments, package_path, allow_outside)
    if not any(joint.independent for joint in arm.parts.joints):
        message = f"no joint of '{arm.path.name}' moves: there is nothing to command"
        raise InvalidInput([Diagnostic("INIT002", message, Place(str(arm.path), 0, 0))])
    read = [arm]
    attached: dict[str, Entry] = {}
    if hand is not None:
        other = _read(hand.description, hand.arguments, package_path, allow_outside)
        read.append(replace(other, prefix=_prefix(arm.parts, other.parts)))
        attached = _attached(hand, arm.parts, read[1].prefix)
    mended, notes = _mended(read)
    root = own_root(folder / "robot.yaml") or Path(os.path.realpath(folder))
    outer = {name: place for each in read for name, place in _outer_packages(each, allow_outside, root).items()}
    notes += [
        f"package '{name}' is outside the project and has no package.xml: commands need --allow-outside, or "
        f"--package-path {shlex.quote(str(place.parent))}, or copy it into the project"
        for name, place in outer.items()
        if not may_name(place, name, root)
    ]
    head = {"robot": Entry(arm.name)}
    tail = ({"args": Entry(dict(arguments))} if arguments else {}) | mended
    anywhere = head | {"description": Entry(str(arm.path))} | _attach(attached, str(read[-1].path)) | tail
    spec = RobotSpec.model_validate({key: plain(entry) for key, entry in anywhere.items()})
    robot, findings = build_robot(
        spec, file=folder / "robot.yaml", package_path=package_path, allow_outside=allow_outside
    )
    warned = sum(finding.severity == "warning" for finding in findings)
    if warned:
        notes.append(
            f"the description has {number_of(warned, 'warning')}: `manipcli check-urdf` of the file lists them"
        )
    placed = _placed(description, arm.path, folder)
    of_hand = _attach(attached, _placed(hand.description, read[1].path, folder)) if hand is not None else {}
    return Source(
        arm.name,
        robot,
        arm.path,
        head | {"description": Entry(placed)} | _packages(outer, folder) | of_hand | tail,
        anywhere,
        tuple(notes),
    )


def _read(description: str, arguments: Mapping[str, str], package_path: tuple[Path, ...], allow_outside: bool) -> _Read:
    """
    Raises:
        InvalidInput: what no robot file mends.
    """
    path = _located(description, package_path)
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    checked = tuple(check for check in CHECKS if check.severity == "error" or check.code == TOO_HEAVY)
    examination = examine(path, packages=packages, arguments=arguments, checks=checked)
    parts = examination.parts
    if parts is None or not parts.root:
        raise InvalidInput(examination.findings)
    return _Read(path, packages, parts, tuple(examination.findings))


def _prefix(arm: Parts, hand: Parts) -> str:
    """`hand_`, where both descriptions have a link or a joint of the same name."""
    if is_mount(hand):
        hand, _ = without_root(hand)
    same_link = {link.name for link in arm.links} & {link.name for link in hand.links}
    same_joint = {joint.name for joint in arm.joints} & {joint.name for joint in hand.joints}
    return "hand_" if same_link or same_joint else ""


def _attached(hand: HandSource, arm: Parts, prefix: str) -> dict[str, Entry]:
    """The entries of `attach` but for the description."""
    found: dict[str, Entry] = {}
    if hand.arguments:
        found["args"] = Entry(dict(hand.arguments))
    if hand.parent is not None:
        found["parent"] = Entry(hand.parent)
    else:
        bare = bare_robot(arm)
        kinematics = Kinematics(bare)
        guessed = guess_parts(bare, ShapePoints(kinematics), kinematics).arm
        tip = guessed.tip if guessed is not None else arm.root
        why = f"the hand is on '{tip}', the last link of the arm, in its frame: --hand-at and --hand-pose change that"
        found["parent"] = Entry(tip, why, True)
    if hand.pose is not None:
        found["pose"] = Entry({"xyz": list(hand.pose[:3])} | ({"rpy": list(hand.pose[3:])} if hand.pose[3:] else {}))
    if prefix:
        found["prefix"] = Entry(prefix, "names of the hand are also names of the arm")
    return found


def _attach(attached: Mapping[str, Entry], description: str) -> dict[str, Entry]:
    """`attach` of the robot file; {} without a hand."""
    if not attached:
        return {}
    row: dict[str, Plain] = {"description": description}
    row |= {key: plain(entry) for key, entry in attached.items()}
    doubts = [entry for entry in attached.values() if entry.why]
    return {"attach": Entry([row], "; ".join(entry.why for entry in doubts), any(entry.check for entry in doubts))}


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


def _outer_packages(read: _Read, allow_outside: bool, root: Path) -> dict[str, Path]:
    """The packages that commands find only by `packages:` or `--package-path`.

    These are the ones of `--package-path`, and the ones around the description, which a log does not know.
    """
    alone, installed = Packages(read.path, allow_outside=allow_outside), Packages(None)
    return {
        name: folder
        for name, folder in read.packages.found.items()
        if not _finds(alone, name, folder) or (not _finds(installed, name, folder) and may_name(folder, name, root))
    }


def _finds(packages: Packages, name: str, folder: Path) -> bool:
    try:
        return packages.root(name) == folder
    except NotFound:
        return False


def _placed(description: str, path: Path, folder: Path) -> str:
    """The description as a robot file in the folder names it."""
    here = os.path.realpath(folder)
    relative = description if "://" in description else os.path.relpath(path, here)
    portable = Packages(path).portable(path)
    if relative.startswith("..") and portable.startswith("package://"):
        try:
            if Packages(None).resolve(portable) == path:
                relative = portable  # an installed package: the same on another machine
        except NotFound:
            pass
    return relative


def _packages(outer: Mapping[str, Path], folder: Path) -> dict[str, Entry]:
    """`packages` for a robot file in the folder."""
    here = os.path.realpath(folder)
    rows: dict[str, Plain] = {name: os.path.relpath(root, here) for name, root in sorted(outer.items())}
    return {"packages": Entry(rows, "for all commands, also those that read only a log")} if rows else {}


def _mended(read: Sequence[_Read]) -> tuple[dict[str, Entry], list[str]]:
    """`inertials` and `collision` of the robot file, where the descriptions lack something."""
    found: dict[str, Entry] = {}
    notes: list[str] = []
    links = [replace(link, name=each.prefix + link.name) for each in read for link in each.parts.links]
    findings = [finding for each in read for finding in each.findings]
    unusable = [link.name for link in links if link.unusable is not None]
    massless, dense = [], []
    for each in read:
        massive = {link.name for link in each.parts.links if link.inertial is not None}
        massless += [each.prefix + name for name in sorted(massless_bodies(each.parts.joints, massive))]
        named = _named(finding for finding in each.findings if finding.code == TOO_HEAVY)
        dense += [each.prefix + name for name in named]
    heavy = [name for name in dense if name not in unusable]
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
    missing = [link for link in links if link.missing]
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
