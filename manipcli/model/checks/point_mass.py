"""Masses without moments of inertia."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import INERTIAL, one_joint

CHECK = Check(
    code="URDF037",
    name="point-mass",
    tier="physics",
    severity="warning",
    summary="A link with a mass has no moments of inertia",
    reason=(
        "A point mass: fine where it is fixed to a larger body, impossible (an error, URDF011) where a joint turns it."
    ),
    bad=one_joint(tip=INERTIAL.replace("0.02", "0"), kind="fixed", inside=""),
    find=found_while_reading("URDF037"),
)
