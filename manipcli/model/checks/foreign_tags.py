"""Elements for other programs."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.core.text import shorten
from manipcli.model.check import Check, Subject
from manipcli.model.located_xml import Element
from manipcli.model.urdf_schema import is_foreign, known_elements

_TOLD_ELSEWHERE: Final = frozenset({"gazebo", "ros2_control"})


def _find(subject: Subject) -> Iterator[Finding]:
    """One finding for each tag: the first of them, and how many there are."""
    found: dict[str, list[Element]] = {}
    for element, _ in known_elements(subject.description.root):
        for child in element.children:
            if is_foreign(child.tag) and child.tag not in _TOLD_ELSEWHERE:
                found.setdefault(child.tag, []).append(child)
    for tag, elements in found.items():
        many = f"{len(elements)} <{shorten(tag)}> elements are" if len(elements) > 1 else f"<{shorten(tag)}> is"
        yield Finding("URDF069", f"{many} for another program, and ignored", elements[0].place, severity="note")


CHECK = Check(
    code="URDF069",
    name="foreign-tags",
    tier="schema",
    severity="note",
    summary="Elements for another program are ignored",
    reason=(
        "Settings for MuJoCo, Drake and others ride along in many descriptions. What they change there (contact, "
        "actuators, loops) is not changed here."
    ),
    bad='<robot name="r"><link name="base"/><mujoco><compiler discardvisual="false"/></mujoco></robot>',
    find=_find,
)
