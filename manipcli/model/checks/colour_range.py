"""Colours beyond what can be shown."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import shorten
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_numbers import finite
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
    for element, _ in known_elements(subject.description.root):
        if element.tag != "color":
            continue
        text = element.attributes.get("rgba", "")
        values = [finite(word) for word in text.split()[:4]]
        if any(value is not None and not 0.0 <= value <= 1.0 for value in values):
            message = f'<color rgba="{shorten(text)}">: expected red, green, blue and opacity from 0 to 1'
            hint = "divide by 255" if any(value is not None and value > 1.0 for value in values) else None
            yield Finding("URDF064", message, element.place, hint, "warning")


CHECK = Check(
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
    find=_find,
)
