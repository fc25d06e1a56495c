"""Limits that cannot be."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_joint

CHECK = Check(
    code="URDF010",
    name="limits",
    tier="physics",
    severity="error",
    summary="A joint has no limits where it needs them, or limits that cannot be",
    reason=(
        "Without limits, with lower above upper or with negative ones no planner can promise anything; PyBullet "
        "takes them without a word."
    ),
    bad=one_joint('<limit lower="1" upper="-1" velocity="1" effort="1"/>'),
    find=found_while_reading("URDF010"),
)
