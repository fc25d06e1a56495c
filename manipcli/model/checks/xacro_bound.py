"""Xacro files that never end."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="XACRO004",
    name="xacro-bound",
    tier="schema",
    severity="error",
    summary="An expansion is beyond a bound",
    reason=(
        "A macro that calls itself, or doubles ten times over, fills the memory; a file that includes itself ends the "
        "interpreter's stack."
    ),
    bad=(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:macro name="again"><xacro:again/></xacro:macro>'
        "<xacro:again/>"
        "</robot>"
    ),
    find=found_while_reading("XACRO004"),
)
