"""Checks of names that other programs reject or confuse."""

import re
from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import shorten
from manipcli.description.lint.check import Subject, check, found_while_reading
from manipcli.description.lint.rigid import elements_by_name
from manipcli.description.lint.samples import one_joint, robot

VERSIONS: Final = ("1.0", "1.1", "1.2")
ALLOWED: Final = re.compile(r"[A-Za-z0-9_.\-]+")


@check("URDF050", "robot-name", "schema", "warning", bad='<robot><link name="base"/></robot>')
def _robot_name(subject: Subject) -> Iterator[Diagnostic]:
    """<robot> has no name, or an unknown version of URDF.

    The specification requires a name, and most parsers (PyBullet, Drake) reject a description without one; manipcli
    uses the name of the file. urdfdom rejects an unknown version.
    """
    yield from found_while_reading("URDF050")(subject)
    root = subject.description.root
    version = root.attributes.get("version", "1.0").strip()
    if version not in VERSIONS:
        message = f"<robot> has the unknown version '{shorten(version)}'; known: {', '.join(VERSIONS)}"
        yield Diagnostic("URDF050", message, root.place, "delete the attribute", "warning")


@check(
    "URDF068",
    "shared-name",
    "schema",
    "note",
    bad=robot(
        '<link name="base"><visual name="v"><geometry><box size="1 1 1"/></geometry></visual><visual name="v">'
        '<geometry><sphere radius="1"/></geometry></visual></link>'
    ),
)
def _shared_name(subject: Subject) -> Iterator[Diagnostic]:
    """Two visuals or two collisions of a link have the same name.

    Programs that look up shapes by name (Drake, MoveIt) rename or drop the second.
    """
    for link in subject.description.root.all("link"):
        for tag in ("visual", "collision"):
            seen: set[str] = set()
            for element in link.all(tag):
                name = element.name
                if name and name in seen:
                    message = f"link '{link.attributes.get('name', '')}' has two <{tag}> named '{name}'"
                    yield Diagnostic("URDF068", message, element.place, severity="note")
                seen.add(name)


@check("URDF331", "ros-names", "readiness", "warning", bad=one_joint().replace('"tip"', '"the tip"'))
def _ros_names(subject: Subject) -> Iterator[Diagnostic]:
    """The name of a link or joint has characters that ROS 2 rejects.

    Joints become parameters and interfaces, links become frames: use letters, digits and _; a space or / fails.
    """
    # `-` and `.` are common in descriptions and harmless.
    for tag in ("link", "joint"):
        for name, element in elements_by_name(subject.description.root, tag).items():
            if name and not ALLOWED.fullmatch(name):
                hint = f"'{re.sub(r'[^A-Za-z0-9_]+', '_', name).strip('_') or tag}'"
                message = f"ROS 2 rejects the name of {tag} '{name}'"
                yield Diagnostic("URDF331", message, element.place, f"rename it to {hint}", "warning")
