"""Materials and their colours."""

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.core.text import did_you_mean, shorten
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.samples import robot
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import finite
from manipcli.description.urdf.schema_table import known_elements


@check(
    "URDF063",
    "undefined-material",
    "schema",
    "warning",
    bad=robot(
        '<link name="base"><visual><geometry><box size="1 1 1"/></geometry><material name="red"/></visual></link>'
    ),
)
def _undefined_material(subject: Subject) -> Iterator[Diagnostic]:
    """A material is used and nowhere defined, or has no name.

    The shape gets a colour that the program likes; some parsers refuse the file.
    """
    materials = [element for element, _ in known_elements(subject.description.root) if element.tag == "material"]
    defined = {each.attributes.get("name", "") for each in materials if each.children}
    for material in materials:
        name = material.attributes.get("name", "")
        if material.children and "name" not in material.attributes:  # an empty one is common, and read
            yield Diagnostic("URDF063", "a material has no name", material.place, 'name="..."', "warning")
        if material.children or name in defined:
            continue
        what = f"material '{name}' has no colour anywhere" if name else "a material has neither a name nor a colour"
        near = did_you_mean(name, sorted(defined), kind="materials") if len(defined) < 100 else None
        yield Diagnostic("URDF063", what, material.place, near or "give it a <color rgba=.../>", "warning")


@check(
    "URDF064",
    "colour-range",
    "schema",
    "warning",
    bad=robot(
        '<link name="base"><visual><geometry><box size="1 1 1"/></geometry><material name="red">'
        '<color rgba="255 0 0 1"/></material></visual></link>'
    ),
)
def _colour_range(subject: Subject) -> Iterator[Diagnostic]:
    """A colour is not within 0 and 1.

    Colours are shares of 1, not of 255: what is larger is drawn white, or as nothing.
    """
    for element, _ in known_elements(subject.description.root):
        if element.tag != "color":
            continue
        text = element.attributes.get("rgba", "")
        values = [finite(word) for word in text.split()[:4]]
        if any(value is not None and not 0.0 <= value <= 1.0 for value in values):
            message = f'<color rgba="{shorten(text)}">: expected red, green, blue and opacity from 0 to 1'
            hint = "divide by 255" if any(value is not None and value > 1.0 for value in values) else None
            yield Diagnostic("URDF064", message, element.place, hint, "warning")


@check(
    "URDF066",
    "redefined-material",
    "schema",
    "warning",
    bad=robot(
        '<material name="red"><color rgba="1 0 0 1"/></material><link name="base"><visual><geometry>'
        '<box size="1 1 1"/></geometry><material name="red"><color rgba="0 1 0 1"/></material></visual></link>'
    ),
)
def _redefined_material(subject: Subject) -> Iterator[Diagnostic]:
    """A material is defined twice, with different colours.

    Programs keep one of the two for all shapes; PyBullet the first.
    """
    first: dict[str, Element] = {}
    for element, _ in known_elements(subject.description.root):
        name = element.attributes.get("name", "")
        if element.tag != "material" or not name or _colour(element) is None:
            continue
        other = first.setdefault(name, element)
        if _colour(other) != _colour(element):
            message = f"material '{name}' has another colour than at {other.place}"
            yield Diagnostic("URDF066", message, element.place, "give each colour a name of its own", "warning")


def _colour(material: Element) -> tuple[float | None, ...] | None:
    colour = material.first("color")
    return tuple(finite(word) for word in colour.attributes.get("rgba", "").split()[:4]) if colour is not None else None
