"""Attributes that an element does not have."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean, shorten
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    for element, rule in known_elements(subject.description.root):
        for name in element.attributes:
            if name in rule.attributes or ":" in name:
                continue
            message = f"<{element.tag}> has no attribute '{shorten(name)}' in URDF; it is ignored"
            hint = did_you_mean(name, sorted(rule.attributes), kind="attributes") if len(name) < 40 else None
            yield Finding("URDF055", message, element.place, hint, "warning")


CHECK = Check(
    code="URDF055",
    name="unknown-attribute",
    tier="schema",
    severity="warning",
    summary="An attribute is none of its element",
    reason="Programs skip what they do not know: what was meant by it is not there, and a default is.",
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/><origin xzy="0 0 1"/></joint>'
        "</robot>"
    ),
    find=_find,
)
