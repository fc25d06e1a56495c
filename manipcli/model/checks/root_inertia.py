"""Inertias of root links."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import INERTIAL, one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    root = elements_by_name(subject.description.root, "link").get(subject.parts.root)
    inertial = root.first("inertial") if root is not None else None
    if inertial is not None and subject.parts.joints:
        message = f"the inertial of root link '{subject.parts.root}' is ignored: the robot stands on it"
        yield Finding("URDF110", message, inertial.place, "put an empty root link before it for KDL", "note")


CHECK = Check(
    code="URDF110",
    name="root-inertia",
    tier="physics",
    severity="note",
    summary="The root link has an inertial, which is ignored",
    reason=(
        "The robot stands on its root link, so that its mass moves nothing; KDL warns of it. On a mobile base "
        "it would matter."
    ),
    bad=one_joint().replace('<link name="base"/>', f'<link name="base">{INERTIAL}</link>'),
    find=_find,
)
