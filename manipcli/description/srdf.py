"""Reader of MoveIt's semantic description (SRDF): groups, states, end effectors, and links that may touch."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import shorten
from manipcli.description.expanded import read_description
from manipcli.description.located_xml import Element
from manipcli.description.packages import Packages


@dataclass(frozen=True, slots=True)
class SrdfGroup:
    """A `<group>`: `chain` (base, tip), or `joints` and `links`; `groups`: names of other groups that it contains."""

    name: str
    chain: tuple[str, str] | None
    joints: tuple[str, ...]
    links: tuple[str, ...]
    groups: tuple[str, ...]
    place: Place | None


@dataclass(frozen=True, slots=True)
class SrdfState:
    """A `<group_state>`: `positions` by joint [rad or m]; joints with several values are left out."""

    name: str
    group: str
    positions: Mapping[str, float]
    place: Place | None


@dataclass(frozen=True, slots=True)
class SrdfEndEffector:
    """An `<end_effector>`: `group` at `parent_link`; `parent_group` may be ''."""

    name: str
    group: str
    parent_link: str
    parent_group: str
    place: Place | None


@dataclass(frozen=True, slots=True)
class Srdf:
    """The contents of a file; `touching`: pairs of links of `<disable_collisions>`; `virtual`: virtual joints."""

    groups: tuple[SrdfGroup, ...]
    states: tuple[SrdfState, ...]
    end_effectors: tuple[SrdfEndEffector, ...]
    touching: tuple[tuple[str, str], ...]
    virtual: tuple[str, ...]

    def group(self, name: str) -> SrdfGroup | None:
        """The group with this name."""
        return next((group for group in self.groups if group.name == name), None)


def read_srdf(path: Path, *, package_path: tuple[Path, ...] = (), arguments: Mapping[str, str] = {}) -> Srdf:
    """Reads an SRDF, plain or as xacro.

    Args:
        path: the file.
        package_path: folders that contain packages, for a xacro file.
        arguments: of a xacro file.

    Raises:
        InvalidInput: the file is not XML, not an SRDF, or has entries without names or numbers.
    """
    packages = Packages(path, package_path=package_path)
    known = arguments if path.suffix == ".xacro" else {}
    root = read_description(path, packages=packages, arguments=known).root
    findings: list[Diagnostic] = []
    if root.all("link") or root.all("joint"):
        hint = "pass a description with --robot; an SRDF has <group> and <disable_collisions>"
        raise InvalidInput([Diagnostic("SRDF001", "this is a URDF, not an SRDF", root.place, hint)])
    made = Srdf(
        tuple(_groups(root, findings)),
        tuple(_states(root, findings)),
        tuple(_end_effectors(root, findings)),
        tuple(_touching(root, findings)),
        tuple(joint.name for joint in root.all("virtual_joint")),
    )
    known_groups = [group.name for group in made.groups]
    for what, name, place in (
        *(("group_state", state.group, state.place) for state in made.states),
        *(("end_effector", effector.group, effector.place) for effector in made.end_effectors),
    ):
        if name not in known_groups:
            findings.append(Diagnostic("SRDF003", f"<{what}>: group '{shorten(name)}' is not in this file", place))
    if findings:
        raise InvalidInput(findings)
    return made


def _needed(element: Element, attribute: str, findings: list[Diagnostic]) -> str:
    value = element.attributes.get(attribute, "").strip()
    if not value:
        findings.append(Diagnostic("SRDF002", f"<{element.tag}> lacks `{attribute}`", element.place))
    return value


def _groups(root: Element, findings: list[Diagnostic]) -> Iterator[SrdfGroup]:
    for element in root.all("group"):
        chain = element.first("chain")
        yield SrdfGroup(
            _needed(element, "name", findings),
            None if chain is None else (_needed(chain, "base_link", findings), _needed(chain, "tip_link", findings)),
            tuple(_needed(joint, "name", findings) for joint in element.all("joint")),
            tuple(_needed(link, "name", findings) for link in element.all("link")),
            tuple(_needed(group, "name", findings) for group in element.all("group")),
            element.place,
        )


def _states(root: Element, findings: list[Diagnostic]) -> Iterator[SrdfState]:
    for element in root.all("group_state"):
        positions = {}
        for joint in element.all("joint"):
            name, text = _needed(joint, "name", findings), _needed(joint, "value", findings)
            values = text.split()
            if len(values) != 1:
                continue  # a floating joint; an empty value is reported above
            try:
                value = float(values[0])
            except ValueError:
                value = math.nan
            if math.isfinite(value):
                positions[name] = value
            else:
                message = f'<joint value="{shorten(text)}">: expected a finite number [rad or m]'
                findings.append(Diagnostic("SRDF004", message, joint.place))
        yield SrdfState(
            _needed(element, "name", findings), _needed(element, "group", findings), positions, element.place
        )


def _end_effectors(root: Element, findings: list[Diagnostic]) -> Iterator[SrdfEndEffector]:
    for element in root.all("end_effector"):
        yield SrdfEndEffector(
            _needed(element, "name", findings),
            _needed(element, "group", findings),
            _needed(element, "parent_link", findings),
            element.attributes.get("parent_group", "").strip(),
            element.place,
        )


def _touching(root: Element, findings: list[Diagnostic]) -> Iterator[tuple[str, str]]:
    for element in root.all("disable_collisions"):
        yield _needed(element, "link1", findings), _needed(element, "link2", findings)
