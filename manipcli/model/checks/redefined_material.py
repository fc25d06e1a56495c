"""Materials of one name and two colours."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.located_xml import Element
from manipcli.model.urdf_numbers import finite
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    first: dict[str, Element] = {}
    for element, _ in known_elements(subject.description.root):
        name = element.attributes.get("name", "")
        if element.tag != "material" or not name or _colour(element) is None:
            continue
        other = first.setdefault(name, element)
        if _colour(other) != _colour(element):
            message = f"material '{name}' has another colour than at {other.place}"
            yield Finding("URDF066", message, element.place, "give each colour a name of its own", "warning")


def _colour(material: Element) -> tuple[float | None, ...] | None:
    colour = material.first("color")
    return tuple(finite(word) for word in colour.attributes.get("rgba", "").split()[:4]) if colour is not None else None


CHECK = Check(
    code="URDF066",
    name="redefined-material",
    tier="schema",
    severity="warning",
    summary="A material is defined twice, with different colours",
    reason="Programs keep one of the two for all shapes; PyBullet the first.",
    bad=(
        '<robot name="r"><material name="red"><color rgba="1 0 0 1"/></material>'
        '<link name="base"><visual><geometry><box size="1 1 1"/></geometry>'
        '<material name="red"><color rgba="0 1 0 1"/></material></visual></link>'
        "</robot>"
    ),
    find=_find,
)
