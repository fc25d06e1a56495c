"""Axes that are not of unit length."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import LIMIT, one_joint

CHECK = Check(
    code="URDF034",
    name="axis-length",
    tier="physics",
    severity="warning",
    summary="The axis of a joint is not of unit length",
    reason=("Only its direction is used here; programs that take it as it is scale velocities and positions with it."),
    bad=one_joint('<axis xyz="0 0 2"/>' + LIMIT),
    find=found_while_reading("URDF034"),
)
