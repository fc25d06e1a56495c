"""Materials without a definition or without a name."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean
from manipcli.model.check import Check, Subject
from manipcli.model.urdf_schema import known_elements


def _find(subject: Subject) -> Iterator[Finding]:
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


CHECK = Check(
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
    find=_find,
)
