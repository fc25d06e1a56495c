"""Names that ROS 2 refuses."""

import re
from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import one_joint

ALLOWED: Final = re.compile(r"[A-Za-z0-9_.\-]+")


def _find(subject: Subject) -> Iterator[Finding]:
    """`-` and `.` are common in descriptions and do no harm."""
    for tag in ("link", "joint"):
        for name, element in elements_by_name(subject.description.root, tag).items():
            if name and not ALLOWED.fullmatch(name):
                hint = f"'{re.sub(r'[^A-Za-z0-9_]+', '_', name).strip('_') or tag}'"
                yield Finding("URDF331", f"ROS 2 refuses the name of {tag} '{name}'", element.place, hint, "warning")


CHECK = Check(
    code="URDF331",
    name="ros-names",
    tier="readiness",
    severity="warning",
    summary="The name of a link or joint has characters that ROS 2 refuses in names",
    reason=(
        "Joints become parameters and interfaces there, links become frames: letters, digits and _ work, a "
        "space or / does not."
    ),
    bad=one_joint().replace('"tip"', '"the tip"'),
    find=_find,
)
