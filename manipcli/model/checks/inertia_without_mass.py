"""Moments of inertia without a mass."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import CUBE, INERTIAL, one_joint
from manipcli.model.urdf_numbers import finite


def _find(subject: Subject) -> Iterator[Finding]:
    for link in subject.description.root.all("link"):
        inertial = link.first("inertial")
        mass = inertial.first("mass") if inertial is not None else None
        inertia = inertial.first("inertia") if inertial is not None else None
        if mass is None or inertia is None or finite(mass.attributes.get("value", "").strip()) != 0.0:
            continue
        if any(finite(inertia.attributes.get(key, "0").strip()) for key in ("ixx", "iyy", "izz")):
            message = f"link '{link.attributes.get('name', '')}' has moments of inertia and mass 0"
            yield Finding("URDF108", message, inertia.place, "state its mass, or leave the inertial out", "warning")


CHECK = Check(
    code="URDF108",
    name="inertia-without-mass",
    tier="physics",
    severity="warning",
    summary="A link has moments of inertia and mass 0",
    reason=(
        "No body is like that; the inertia is left out, and the joint that moves the link may move nothing at all."
    ),
    bad=one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
    find=_find,
)
