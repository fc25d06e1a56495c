"""Transmissions that are not complete."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_joint

CHECK = Check(
    code="URDF015",
    name="transmission",
    tier="readiness",
    severity="error",
    summary="A transmission lacks its type or joint, names an unknown joint, or has a reduction of 0",
    reason="ros_control refuses it at start-up, or worse: loads it with a reduction of 1.",
    bad=one_joint(more='<transmission name="t"><joint name="j"/></transmission>'),
    find=found_while_reading("URDF015"),
)
