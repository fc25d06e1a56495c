"""Names of mesh files that say another format than the file has."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.mesh import SUFFIXES
from manipcli.model.mesh_stl import binary_stl
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import TETRAHEDRON, one_link


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is None or mesh.path is None:
            continue
        suffix, kind = mesh.path.suffix, facts.format.partition("-")[0]
        if SUFFIXES.get(suffix.lower()) != kind:
            message = (
                f"mesh '{mesh.uri}' ends in '{suffix}' and holds {kind.upper() if kind != 'collada' else 'Collada'}"
            )
            ending = next(ending for ending, known in SUFFIXES.items() if known == kind)
            yield Finding("URDF203", message, mesh.element.place, f"name it *{ending}", "warning")


CHECK = Check(
    code="URDF203",
    name="mesh-suffix",
    tier="assets",
    severity="warning",
    summary="The name of a mesh file says another format than the file has",
    reason="Most programs go by the name and fail, or draw nothing; here the content decides.",
    bad=one_link('filename="a.obj"'),
    find=_find,
    files=lambda: {"a.obj": binary_stl(TETRAHEDRON)},
)
