"""Names that programs trip over."""

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
    """<robot> has no name, or a version that URDF does not have.

    The specification asks for a name, and most parsers refuse a description without one (PyBullet and Drake do);
    manipcli takes the name of the file. urdfdom refuses a version that it does not know.
    """
    yield from found_while_reading("URDF050")(subject)
    root = subject.description.root
    version = root.attributes.get("version", "1.0").strip()
    if version not in VERSIONS:
        message = f"<robot> is of version '{shorten(version)}'; URDF has {', '.join(VERSIONS)}"
        yield Diagnostic("URDF050", message, root.place, "leave it out", "warning")


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

    Programs that find shapes by name (Drake, MoveIt) rename or lose the second.
    """
    for link in subject.description.root.all("link"):
        for tag in ("visual", "collision"):
            seen: set[str] = set()
            for element in link.all(tag):
                name = element.name
                if name and name in seen:
                    message = f"two <{tag}> of link '{link.attributes.get('name', '')}' are named '{name}'"
                    yield Diagnostic("URDF068", message, element.place, severity="note")
                seen.add(name)


@check("URDF331", "ros-names", "readiness", "warning", bad=one_joint().replace('"tip"', '"the tip"'))
def _ros_names(subject: Subject) -> Iterator[Diagnostic]:
    """The name of a link or joint has characters that ROS 2 refuses in names.

    Joints become parameters and interfaces there, links become frames: letters, digits and _ work, a space or /
    does not.
    """
    # `-` and `.` are common in descriptions and do no harm.
    for tag in ("link", "joint"):
        for name, element in elements_by_name(subject.description.root, tag).items():
            if name and not ALLOWED.fullmatch(name):
                hint = f"'{re.sub(r'[^A-Za-z0-9_]+', '_', name).strip('_') or tag}'"
                yield Diagnostic("URDF331", f"ROS 2 refuses the name of {tag} '{name}'", element.place, hint, "warning")
