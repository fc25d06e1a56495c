"""Descriptions of nothing."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF080",
    name="no-link",
    tier="topology",
    severity="error",
    summary="The description has no link",
    reason="There is nothing to load; mostly a xacro file that only defines macros and calls none.",
    bad=('<robot name="r"></robot>'),
    find=found_while_reading("URDF080"),
)
