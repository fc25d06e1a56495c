"""Collision meshes of more triangles than a collision needs."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.mesh_stl import binary_stl
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import TETRAHEDRON, one_link

MANY: Final = 200_000


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if mesh.role == "collision" and facts is not None and facts.triangles > MANY:
            message = f"collision mesh '{mesh.uri}' has {facts.triangles} triangles; {MANY} are many"
            yield Finding(
                "URDF207", message, mesh.element.place, "use a simplified mesh, or a box or cylinder", "warning"
            )


CHECK = Check(
    code="URDF207",
    name="mesh-triangles",
    tier="assets",
    severity="warning",
    summary="A collision mesh has more than 200 000 triangles",
    reason="Every load reads it all (seconds for a million), for a hull that needs a hundred. 2 000 000 are refused.",
    bad=one_link('filename="a.stl"', role="collision"),
    find=_find,
    files=lambda: {"a.stl": binary_stl(np.tile(TETRAHEDRON, (MANY // 4 + 1, 1, 1)))},
)
