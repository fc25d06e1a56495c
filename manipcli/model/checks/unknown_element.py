"""Elements that URDF does not have."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import nearest, shorten
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_schema import RULES, is_foreign, known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    for element, rule in known_elements(subject.description.root):
        if element.tag == "geometry":
            continue  # what is no shape is told where shapes are read
        for child in element.children:
            if child.tag in RULES or child.tag == "transmission" or is_foreign(child.tag):
                continue
            message = f"unknown element <{shorten(child.tag)}> in <{element.tag}>; it is ignored"
            close = nearest(child.tag, [*sorted(rule.children), *RULES]) if len(child.tag) < 40 else ()
            yield Finding("URDF053", message, child.place, f"did you mean <{close[0]}>?" if close else None, "warning")


CHECK = Check(
    code="URDF053",
    name="unknown-element",
    tier="schema",
    severity="warning",
    summary="An element is none of URDF",
    reason=(
        "Programs skip what they do not know: a misspelt <colision> is a link that nothing touches. Elements that are "
        "known to speak to another program (gazebo, ros2_control, anything with a prefix) are left alone."
    ),
    bad=(
        '<robot name="r"><link name="base"><colision><geometry><box size="1 1 1"/></geometry></colision></link></robot>'
    ),
    find=_find,
)
