"""Collada files that state another up axis than z."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import collada_tetrahedron, one_link


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is not None and facts.up_axis != "Z_UP":
            said = f"the up axis {facts.up_axis}" if facts.up_axis else "no up axis, which stands for Y_UP"
            message = f"mesh '{mesh.uri}' states {said}; it changes nothing here, as in RViz"
            yield Finding("URDF211", message, mesh.element.place, "export it with z up: programs differ", "note")


CHECK = Check(
    code="URDF211",
    name="collada-up-axis",
    tier="assets",
    severity="note",
    summary="A Collada file states an up axis other than z, or none",
    reason=(
        "RViz, MoveIt and Pinocchio take the numbers of the file as they are, and so does manipcli; PyBullet and "
        "three.js turn the mesh. Only a file with z up looks the same everywhere."
    ),
    bad=one_link('filename="a.dae"'),
    find=_find,
    files=lambda: {"a.dae": collada_tetrahedron(up_axis="Y_UP")},
)
