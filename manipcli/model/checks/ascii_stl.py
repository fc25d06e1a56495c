"""STL files written as text."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import ascii_tetrahedron, one_link


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is not None and facts.format == "stl-ascii":
            message = f"mesh '{mesh.uri}' is an STL file of text, which some programs cannot read; here it is converted"
            yield Finding("URDF208", message, mesh.element.place, "save it as binary STL", "note")


CHECK = Check(
    code="URDF208",
    name="ascii-stl",
    tier="assets",
    severity="note",
    summary="An STL file is written as text",
    reason="PyBullet, among others, takes it for empty without a word; engines get a binary one here.",
    bad=one_link('filename="a.stl"'),
    find=_find,
    files=lambda: {"a.stl": ascii_tetrahedron()},
)
