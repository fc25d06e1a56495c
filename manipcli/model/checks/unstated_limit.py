"""Limits of velocity or effort that are 0 or missing; one end of a range that is missing."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_joint

CHECK = Check(
    code="URDF036",
    name="unstated-limit",
    tier="physics",
    severity="warning",
    summary="A limit of velocity or effort is 0 or missing, or one end of a range is missing",
    reason=(
        "Many descriptions carry zeros there. It counts as not stated; a plan in minimal time needs it, and the "
        "robot file can state it. A lower or upper end that is missing counts as 0, as everywhere."
    ),
    bad=one_joint('<limit lower="-1" upper="1" velocity="0" effort="1"/>'),
    find=found_while_reading("URDF036"),
)
