"""Expressions that would do more than compute."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="XACRO002",
    name="xacro-refused",
    tier="schema",
    severity="error",
    summary="An expression or substitution asks for what a description may not do",
    reason=(
        "The usual evaluation of xacro runs any Python and reads any file. Here a description is data: expressions "
        "compute numbers and text, and only what they need for that is there."
    ),
    bad=('<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="${load_yaml.__globals__}"/></robot>'),
    find=found_while_reading("XACRO002"),
)
