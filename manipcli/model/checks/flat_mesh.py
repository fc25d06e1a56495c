"""Collision meshes without a volume."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.mesh_stl import binary_stl
from manipcli.model.samples import TETRAHEDRON, one_link

CHECK = Check(
    code="URDF210",
    name="flat-mesh",
    tier="assets",
    severity="error",
    summary="A collision mesh is flat",
    reason="A collision shape is the hull of its points; a hull without a volume catches nothing.",
    bad=one_link('filename="a.stl"', role="collision"),
    find=found_while_reading("URDF210"),
    files=lambda: {"a.stl": binary_stl(TETRAHEDRON * (1.0, 1.0, 0.0))},
)
