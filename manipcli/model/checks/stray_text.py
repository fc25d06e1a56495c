"""Text between elements."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import shorten
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    for element, _ in known_elements(subject.description.root):
        if element.text:
            message = f"text in <{element.tag}>, which is ignored: '{shorten(' '.join(element.text[:200].split()))}'"
            hint = "URDF says everything with attributes; a remark is written <!-- like this -->"
            yield Finding("URDF057", message, element.text_place or element.place, hint, "warning")


CHECK = Check(
    code="URDF057",
    name="stray-text",
    tier="schema",
    severity="warning",
    summary="There is text where URDF has none",
    reason="A value written between tags is read by nobody; a comment without its marks may hide what stood there.",
    bad=(
        '<robot name="r">'
        '<link name="base"><inertial><mass value="1">2</mass>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        "</robot>"
    ),
    find=_find,
)
