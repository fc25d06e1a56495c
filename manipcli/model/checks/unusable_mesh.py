"""Collision meshes whose files hold no mesh."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_link

CHECK = Check(
    code="URDF200",
    name="unusable-mesh",
    tier="assets",
    severity="error",
    summary="A collision mesh is damaged, empty, too large, or of a format that is not read",
    reason=(
        "An engine answers with a crash (an index out of range), with a shape somewhere else (a negative one), "
        "or with none at all, so that an arm passes through what it should hit."
    ),
    bad=one_link('filename="cut.stl"', role="collision"),
    find=found_while_reading("URDF200"),
    files=lambda: {"cut.stl": b"cut off".ljust(80) + (12).to_bytes(4, "little") + bytes(50 * 11)},
)
