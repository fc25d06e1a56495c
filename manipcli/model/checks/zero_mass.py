"""Links of no mass."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import CUBE, INERTIAL, one_joint

CHECK = Check(
    code="URDF031",
    name="zero-mass",
    tier="physics",
    severity="note",
    summary="A link has an inertial of mass 0",
    reason=(
        "It counts as having none: fine for a frame such as tool0; a joint that moves nothing else is told as URDF100."
    ),
    bad=one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
    find=found_while_reading("URDF031"),
)
