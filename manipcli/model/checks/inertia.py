"""Masses and moments of inertia that no body has."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import CUBE, INERTIAL, one_joint

CHECK = Check(
    code="URDF011",
    name="inertia",
    tier="physics",
    severity="error",
    summary="A mass or inertia is one that no body has",
    reason="An engine divides by it: PyBullet sets such an inertia to zero and the joint stands still for ever.",
    bad=one_joint(tip=INERTIAL.replace('ixx="', 'ixx="-') + CUBE),
    find=found_while_reading("URDF011"),
)
