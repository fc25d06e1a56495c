"""Joints that do not say which links they join."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF060",
    name="joint-ends",
    tier="schema",
    severity="error",
    summary="A joint has no parent or no child",
    reason="A joint joins two links; without both, the description is no tree.",
    bad=('<robot name="r"><link name="base"/><joint name="j" type="fixed"><parent link="base"/></joint></robot>'),
    find=found_while_reading("URDF060"),
)
