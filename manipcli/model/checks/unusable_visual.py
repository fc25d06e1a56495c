"""Visual meshes whose files hold no mesh."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.mesh_facts import mesh_facts
from manipcli.model.mesh_fault import UnusableMesh
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import one_link


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        if mesh.role == "collision" or mesh.path is None:
            continue
        try:
            mesh_facts(mesh.path)
        except UnusableMesh as error:
            message = f"visual mesh '{mesh.uri}' {error.reason}"
            yield Finding("URDF212", message, mesh.element.place, error.hint, "warning")


CHECK = Check(
    code="URDF212",
    name="unusable-visual",
    tier="assets",
    severity="warning",
    summary="A visual mesh is damaged, empty, too large, or of a format that is not read",
    reason="The link is not drawn. An engine that reads it may crash, so it is given none.",
    bad=one_link('filename="text.stl"'),
    find=_find,
    files=lambda: {"text.stl": b"<!DOCTYPE html><html>404 not found</html>"},
)
