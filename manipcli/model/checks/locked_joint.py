"""Joints without room to move."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_joint

CHECK = Check(
    code="URDF035",
    name="locked-joint",
    tier="physics",
    severity="warning",
    summary="A joint moves by its type and has equal limits",
    reason="Nothing can be planned for it; where it is meant to stand still, its type is fixed.",
    bad=one_joint('<limit lower="0" upper="0" velocity="1" effort="1"/>'),
    find=found_while_reading("URDF035"),
)
