"""Xacro files that do not expand."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="XACRO001",
    name="xacro-expansion",
    tier="schema",
    severity="error",
    summary="A xacro file cannot be expanded",
    reason=(
        "An undefined property or macro, a missing or unknown parameter, a block nobody uses, a bad condition: the "
        "place is that of the innermost element, the hint names the macros around it."
    ),
    bad=('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${nmae}"/></robot>'),
    find=found_while_reading("XACRO001"),
)
