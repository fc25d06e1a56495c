"""Arguments of xacro files."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="XACRO003",
    name="xacro-argument",
    tier="schema",
    severity="error",
    summary="An argument is unknown, or has neither a value nor a default",
    reason="A misspelt argument would leave the default in place without a word.",
    bad=('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg prefix)base"/></robot>'),
    find=found_while_reading("XACRO003"),
)
