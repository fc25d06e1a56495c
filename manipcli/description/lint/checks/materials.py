"""Checks of materials and their colours."""

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
    """A material is used but not defined, or has no name.

    The shape gets a default colour that depends on the program; some parsers reject the file.
    """
    materials = [element for element, _ in known_elements(subject.description.root) if element.tag == "material"]
    defined = {material.attributes.get("name", "") for material in materials if material.children}
    for material in materials:
        name = material.attributes.get("name", "")
        if material.children and "name" not in material.attributes:  # an empty name is common and accepted
            yield Diagnostic("URDF063", "a material has no name", material.place, 'name="..."', "warning")
        if material.children or name in defined:
            continue
        what = f"material '{name}' is not defined" if name else "a material has neither a name nor a colour"
        near = did_you_mean(name, sorted(defined), kind="materials") if len(defined) < 100 else None
        yield Diagnostic("URDF063", what, material.place, near or 'add <color rgba="..."/>', "warning")


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
    """A colour value is outside 0 to 1.

    Colour values range from 0 to 1, not to 255: larger values are drawn white or not at all.
    """
    for element, _ in known_elements(subject.description.root):
        if element.tag != "color":
            continue
        text = element.attributes.get("rgba", "")
        values = [finite(word) for word in text.split()[:4]]
        if any(value is not None and not 0.0 <= value <= 1.0 for value in values):
            message = f'<color rgba="{shorten(text)}">: values outside 0 to 1'
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

    Programs use one of the two for all shapes; PyBullet uses the first.
    """
    first: dict[str, Element] = {}
    for element, _ in known_elements(subject.description.root):
        name = element.attributes.get("name", "")
        if element.tag != "material" or not name or _colour(element) is None:
            continue
        other = first.setdefault(name, element)
        if _colour(other) != _colour(element):
            message = f"material '{name}' is defined with a different colour at {other.place}"
            yield Diagnostic("URDF066", message, element.place, "use one name per colour", "warning")


def _colour(material: Element) -> tuple[float | None, ...] | None:
    colour = material.first("color")
    return tuple(finite(word) for word in colour.attributes.get("rgba", "").split()[:4]) if colour is not None else None
