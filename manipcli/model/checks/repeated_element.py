"""Elements that are there twice where one is read."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    for element, rule in known_elements(subject.description.root):
        seen: set[str] = set()
        for child in element.children:
            if child.tag in seen and child.tag in rule.once:
                message = f"<{element.tag}> has more than one <{child.tag}>; the first is used"
                yield Finding("URDF056", message, child.place, "delete one of them", "warning")
            seen.add(child.tag)


CHECK = Check(
    code="URDF056",
    name="repeated-element",
    tier="schema",
    severity="warning",
    summary="An element is there twice where one is read",
    reason="Programs read the first, some the last: the same file then is two robots.",
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/>'
        '<origin xyz="0 0 1"/><origin xyz="0 0 2"/></joint>'
        "</robot>"
    ),
    find=_find,
)
