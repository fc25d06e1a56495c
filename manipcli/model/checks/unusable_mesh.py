"""Mesh files that hold no mesh."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.mesh_facts import mesh_facts
from manipcli.model.mesh_fault import UnusableMesh
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import one_link


def _find(subject: Subject) -> Iterator[Finding]:
    """Of visuals: those of collisions are found while reading."""
    yield from (finding for finding in subject.parts.findings if finding.code == "URDF200")
    for mesh in named_meshes(subject):
        if mesh.role == "collision" or mesh.path is None or not subject.packages.reads:
            continue
        try:
            mesh_facts(mesh.path)
        except UnusableMesh as error:
            message = f"visual mesh '{mesh.uri}' {error.reason}"
            yield Finding("URDF200", message, mesh.element.place, error.hint, "warning")


CHECK = Check(
    code="URDF200",
    name="unusable-mesh",
    tier="assets",
    severity="error",
    summary="A mesh file is damaged, empty, too large, or of a format that is not read",
    reason=(
        "An engine answers with a crash (an index out of range), with a shape somewhere else (a negative one), or with "
        "none at all, so that an arm passes through what it should hit. Of a visual it is only a warning."
    ),
    bad=one_link('filename="cut.stl"', role="collision"),
    find=_find,
    files=lambda: {"cut.stl": b"cut off".ljust(80) + (12).to_bytes(4, "little") + bytes(50 * 11)},
)
