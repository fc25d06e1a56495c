"""Shapes of one link that have the same name."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject


def _find(subject: Subject) -> Iterator[Finding]:
    for link in subject.description.root.all("link"):
        for tag in ("visual", "collision"):
            seen: set[str] = set()
            for element in link.all(tag):
                name = element.attributes.get("name", "").strip()
                if name and name in seen:
                    message = f"two <{tag}> of link '{link.attributes.get('name', '')}' are named '{name}'"
                    yield Finding("URDF068", message, element.place, severity="note")
                seen.add(name)


CHECK = Check(
    code="URDF068",
    name="shared-name",
    tier="schema",
    severity="note",
    summary="Two visuals or two collisions of a link have the same name",
    reason="Programs that find shapes by name (Drake, MoveIt) rename or lose the second.",
    bad=(
        '<robot name="r">'
        '<link name="base"><visual name="v"><geometry><box size="1 1 1"/></geometry></visual>'
        '<visual name="v"><geometry><sphere radius="1"/></geometry></visual></link>'
        "</robot>"
    ),
    find=_find,
)
