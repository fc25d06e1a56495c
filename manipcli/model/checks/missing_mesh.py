"""Collision meshes that are not found."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_link
from manipcli.model.urdf_mesh import WITHOUT_IT

CHECK = Check(
    code="URDF013",
    name="missing-mesh",
    tier="assets",
    severity="error",
    summary="A collision mesh is not found",
    reason=(
        "A link without its collision shape passes through what it should hit. Many descriptions are published without "
        f"their meshes: {WITHOUT_IT}. A missing visual is a warning, URDF033."
    ),
    bad=one_link('filename="package://missing_package/a.stl"', role="collision"),
    find=found_while_reading("URDF013"),
)
