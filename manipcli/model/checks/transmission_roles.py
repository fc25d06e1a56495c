"""Transmissions of two joints without roles."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import TRANSMISSIONS, role, transmissions
from manipcli.model.samples import INERTIAL, LIMIT, one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    for found in transmissions(subject):
        if TRANSMISSIONS.get(found.type) != 2:
            continue
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            wanted = [f"{tag}1", f"{tag}2"]
            roles = [role(element) for element in elements]
            if len(elements) == 2 and sorted(roles) != wanted:
                shown = " and ".join(f"'{each}'" if each else "none" for each in roles)
                message = (
                    f"transmission '{found.name}': its {tag}s have the roles {shown}; expected {' and '.join(wanted)}"
                )
                how = "<role>joint1</role>" if found.ros1 else 'role="joint1"'
                yield Finding("URDF312", message, elements[0].place, how.replace("joint", tag))


CHECK = Check(
    code="URDF312",
    name="transmission-roles",
    tier="readiness",
    severity="error",
    summary="A transmission of two joints does not say which joint and actuator is which",
    reason=(
        "A differential or a four-bar linkage maps its two joints in different ways; ros2_control sorts them by "
        "name and swaps them without a word."
    ),
    bad=one_joint(
        more='<link name="other">'
        + INERTIAL
        + '</link><joint name="k" type="revolute"><parent link="tip"/><child link="other"/>'
        + LIMIT
        + '</joint><transmission name="t"><type>transmission_interface/DifferentialTransmission</type>'
        + "".join(
            f'<joint name="{name}"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>'
            f'<actuator name="m{name}"><mechanicalReduction>1</mechanicalReduction></actuator>'
            for name in "jk"
        )
        + "</transmission>"
    ),
    find=_find,
)
