"""A robot without a name."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF050",
    name="robot-name",
    tier="schema",
    severity="warning",
    summary="<robot> has no name",
    reason=(
        "The specification asks for a name, and most parsers refuse a description without one (PyBullet and Drake do); "
        "manipcli takes the name of the file."
    ),
    bad='<robot><link name="base"/></robot>',
    find=found_while_reading("URDF050"),
)
