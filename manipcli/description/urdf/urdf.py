"""Links, joints and transmissions of a description's tree, with all errors at once.

Rejects everything that an engine would crash on or silently misread: names, references, tree structure, finite
numbers, axes, limits, masses and inertias, shapes, meshes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.core.errors import Diagnostic, Place
from manipcli.description.elements import Joint, Link, TransmissionTag, UnusableInertial
from manipcli.description.expanded import Description
from manipcli.description.located_xml import Element
from manipcli.description.urdf.control_limits import with_control_limits
from manipcli.description.urdf.joint import read_joint, read_transmissions
from manipcli.description.urdf.link import IMPOSSIBLE, read_link, read_materials
from manipcli.description.urdf.mimic import resolve_mimics
from manipcli.description.urdf.numbers import Reader
from manipcli.description.urdf.topology import check_tree, depth_first


@dataclass(frozen=True, slots=True)
class Parts:
    """Contents of a description. With errors, `root` may be '' and the rest is what could be read.

    `findings`: errors and warnings, in the order of reading.
    """

    name: str
    root: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    transmissions: tuple[TransmissionTag, ...]
    findings: tuple[Diagnostic, ...]

    @property
    def errors(self) -> tuple[Diagnostic, ...]:
        return tuple(finding for finding in self.findings if finding.severity == "error")


def read_parts(description: Description) -> Parts:
    """Links, joints (parents before children, depth first) and transmissions of a description, with all findings."""
    reader = Reader()
    root = description.root
    places: dict[tuple[str, str], Place] = {}
    name = root.name
    if not name:
        reader.report("URDF050", "<robot> has no attribute 'name'", root.place, severity="warning")
    links_by_name = _named(reader, root, "link", places)
    joints_by_name = _named(reader, root, "joint", places)
    if not links_by_name:
        hint = None
        if root.first("group") or root.first("disable_collisions"):
            hint = "this looks like an SRDF: use the URDF that belongs to it"
        elif description.expanded:
            hint = "use the file that calls the macros"
        reader.report("URDF080", "the description has no link", root.place, hint=hint)
    materials = read_materials(reader, root)
    links = {key: read_link(reader, each, key, description.packages, materials) for key, each in links_by_name.items()}
    joints = {key: read_joint(reader, element, key) for key, element in joints_by_name.items()}
    known = {key: joint for key, joint in joints.items() if joint is not None}
    complete = len(joints_by_name) == len(root.all("joint"))
    top = check_tree(reader, links_by_name, joints, joints_by_name, complete=complete) if links else ""
    known = with_control_limits(root, resolve_mimics(reader, known, joints_by_name))
    transmissions = read_transmissions(reader, root, joints_by_name)
    links |= _point_masses(reader, links, known, places)
    ordered = depth_first(top, known) if top else tuple(known.values())
    order = [top, *(joint.child for joint in ordered)] if top else list(links)
    return Parts(
        name=name or description.path.stem.partition(".")[0],
        root=top,
        links=tuple(links[link] for link in order if link in links),
        joints=ordered,
        transmissions=transmissions,
        findings=(*description.findings, *reader.findings),
    )


def _point_masses(
    reader: Reader, links: Mapping[str, Link], joints: Mapping[str, Joint], places: Mapping[tuple[str, str], Place]
) -> dict[str, Link]:
    """Links with mass and without moments of inertia: an error below a moving joint, else a warning.

    Returns those that no engine can use, marked as such.
    """
    unusable = {}
    moved = {joint.child for joint in joints.values() if joint.moves}
    for name, link in links.items():
        if link.inertial is None or link.inertial.inertia.any():
            continue
        message = f"link '{name}' has mass but no moments of inertia"
        hint = "compute them from the shape and the mass of the link"
        if name in moved:
            reader.report(IMPOSSIBLE, message, places.get(("link", name)), hint=hint)
            known = UnusableInertial((reader.findings[-1],), link.inertial.mass, link.inertial.X_LI)
            unusable[name] = dataclasses.replace(link, inertial=None, unusable=known)
        else:
            reader.report("URDF037", f"{message}: a point mass", places.get(("link", name)), severity="warning")
    return unusable


def _named(reader: Reader, root: Element, tag: str, places: dict[tuple[str, str], Place]) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in root.all(tag):
        name = reader.name(element)
        if name is None:
            continue
        if name in found:
            first = found[name].place
            origin = f" ({first.expanded})" if first is not None and first.expanded else ""
            message = f"duplicate {tag} '{name}'; the first is at {first}{origin}"
            reader.report("URDF005", message, element.place)
            continue
        found[name] = element
        if element.place is not None:
            places[(tag, name)] = element.place
    return found
