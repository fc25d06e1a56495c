"""What a xacro file itself warns of."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="XACRO010",
    name="xacro-warning",
    tier="schema",
    severity="warning",
    summary="The description or its expansion gives a warning",
    reason="Authors of macros warn of deprecated files and of values that do not fit together.",
    bad=('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base${xacro.warning(0)}"/></robot>'),
    find=found_while_reading("XACRO010"),
)
