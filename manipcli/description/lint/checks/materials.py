"""Materials and their colours."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean, shorten
from manipcli.description.lint.check import Check, Subject
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import finite
from manipcli.description.urdf.schema_table import known_elements


def _undefined_material(subject: Subject) -> Iterator[Finding]:
    """Materials without a definition or without a name."""
    materials = [element for element, _ in known_elements(subject.description.root) if element.tag == "material"]
    defined = {each.attributes.get("name", "") for each in materials if each.children}
    for material in materials:
        name = material.attributes.get("name", "")
        if material.children and "name" not in material.attributes:  # an empty one is common, and read
            yield Finding("URDF063", "a material has no name", material.place, 'name="..."', "warning")
        if material.children or name in defined:
            continue
        what = f"material '{name}' has no colour anywhere" if name else "a material has neither a name nor a colour"
        near = did_you_mean(name, sorted(defined), kind="materials") if len(defined) < 100 else None
        yield Finding("URDF063", what, material.place, near or "give it a <color rgba=.../>", "warning")


def _colour_range(subject: Subject) -> Iterator[Finding]:
    """Colours beyond what can be shown."""
    for element, _ in known_elements(subject.description.root):
        if element.tag != "color":
            continue
        text = element.attributes.get("rgba", "")
        values = [finite(word) for word in text.split()[:4]]
        if any(value is not None and not 0.0 <= value <= 1.0 for value in values):
            message = f'<color rgba="{shorten(text)}">: expected red, green, blue and opacity from 0 to 1'
            hint = "divide by 255" if any(value is not None and value > 1.0 for value in values) else None
            yield Finding("URDF064", message, element.place, hint, "warning")


def _redefined_material(subject: Subject) -> Iterator[Finding]:
    """Materials of one name and two colours."""
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


MATERIAL_CHECKS: tuple[Check, ...] = (
    Check(
        code="URDF063",
        name="undefined-material",
        tier="schema",
        severity="warning",
        summary="A material is used and nowhere defined, or has no name",
        reason="The shape gets a colour that the program likes; some parsers refuse the file.",
        bad=(
            '<robot name="r">'
            '<link name="base"><visual><geometry><box size="1 1 1"/></geometry><material name="red"/></visual></link>'
            "</robot>"
        ),
        find=_undefined_material,
    ),
    Check(
        code="URDF064",
        name="colour-range",
        tier="schema",
        severity="warning",
        summary="A colour is not within 0 and 1",
        reason="Colours are shares of 1, not of 255: what is larger is drawn white, or as nothing.",
        bad=(
            '<robot name="r">'
            '<link name="base"><visual><geometry><box size="1 1 1"/></geometry>'
            '<material name="red"><color rgba="255 0 0 1"/></material></visual></link>'
            "</robot>"
        ),
        find=_colour_range,
    ),
    Check(
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
        find=_redefined_material,
    ),
)
