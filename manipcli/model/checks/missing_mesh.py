"""Collision meshes that are not found."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_link

CHECK = Check(
    code="URDF013",
    name="missing-mesh",
    tier="assets",
    severity="error",
    summary="A collision mesh is not found",
    reason=(
        "A link without its collision shape passes through what it should hit. Many descriptions are published without "
        "their meshes: put the file there, or a <box>, <cylinder> or the mesh of the <visual> in its place, or take "
        "the <collision> out, after which the link touches nothing. A missing visual is a warning, URDF033."
    ),
    bad=one_link('filename="package://missing_package/a.stl"', role="collision"),
    find=found_while_reading("URDF013"),
)
