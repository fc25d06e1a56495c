"""Visual meshes that are not found."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_link

CHECK = Check(
    code="URDF033",
    name="missing-visual",
    tier="assets",
    severity="warning",
    summary="A visual mesh is not found",
    reason="The link is not drawn; PyBullet refuses the whole robot for it, so engines are given none.",
    bad=one_link('filename="package://missing_package/a.stl"'),
    find=found_while_reading("URDF033"),
)
