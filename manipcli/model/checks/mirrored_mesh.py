"""Meshes with a negative scale."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.mesh_stl import binary_stl
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import TETRAHEDRON, one_link


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        if min(mesh.scale) < 0.0:
            shown = " ".join(f"{value:g}" for value in mesh.scale)
            message = f"mesh '{mesh.uri}' is mirrored by its scale {shown}"
            yield Finding("URDF209", message, mesh.element.place, None, "note")


CHECK = Check(
    code="URDF209",
    name="mirrored-mesh",
    tier="assets",
    severity="note",
    summary="A mesh is mirrored by a negative scale",
    reason="Legal and common for left and right parts; some programs draw such a mesh inside out.",
    bad=one_link('filename="a.stl" scale="1 -1 1"'),
    find=_find,
    files=lambda: {"a.stl": binary_stl(TETRAHEDRON)},
)
