"""A robot without a name, or of another version of URDF."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.core.text import shorten
from manipcli.model.check import Check, Subject, found_while_reading

VERSIONS: Final = ("1.0", "1.1", "1.2")


def _find(subject: Subject) -> Iterator[Finding]:
    yield from found_while_reading("URDF050")(subject)
    root = subject.description.root
    version = root.attributes.get("version", "1.0").strip()
    if version not in VERSIONS:
        message = f"<robot> is of version '{shorten(version)}'; URDF has {', '.join(VERSIONS)}"
        yield Finding("URDF050", message, root.place, "leave it out", "warning")


CHECK = Check(
    code="URDF050",
    name="robot-name",
    tier="schema",
    severity="warning",
    summary="<robot> has no name, or a version that URDF does not have",
    reason=(
        "The specification asks for a name, and most parsers refuse a description without one (PyBullet and Drake do); "
        "manipcli takes the name of the file. urdfdom refuses a version that it does not know."
    ),
    bad='<robot><link name="base"/></robot>',
    find=_find,
)
