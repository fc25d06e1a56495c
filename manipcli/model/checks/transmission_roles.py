"""Transmissions without roles."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import SIZES, role, transmissions
from manipcli.model.samples import INERTIAL, LIMIT, one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    """ros2_control wants a role everywhere; ROS 1 only where there are two."""
    for found in transmissions(subject):
        pairs = SIZES.get(found.type) == 2
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            roles = [role(element) for element in elements]
            how = "<role>{}1</role>" if found.ros1 else 'role="{}1"'
            if pairs and len(elements) == 2 and sorted(roles) != [f"{tag}1", f"{tag}2"]:
                shown = " and ".join(f"'{each}'" if each else "none" for each in roles)
                expected = f"{tag}1 and {tag}2"
                message = f"transmission '{found.name}': its {tag}s have the roles {shown}; expected {expected}"
                yield Finding("URDF312", message, elements[0].place, how.format(tag))
            elif not pairs and not found.ros1 and "" in roles:
                message = f"transmission '{found.name}': a {tag} has no role"
                yield Finding("URDF312", message, elements[roles.index("")].place, how.format(tag))
            names = [element.attributes.get("name", "").strip() for element in elements]
            if pairs and len(names) == 2 and names[0] and names[0] == names[1]:
                message = f"transmission '{found.name}': {tag} '{names[0]}' has both roles; expected two {tag}s"
                yield Finding("URDF312", message, elements[1].place, None)


CHECK = Check(
    code="URDF312",
    name="transmission-roles",
    tier="readiness",
    severity="error",
    summary="A transmission does not say by roles which joint and actuator is which",
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
