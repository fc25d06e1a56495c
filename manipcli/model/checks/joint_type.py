"""Joints of no type or of an unknown one."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF008",
    name="joint-type",
    tier="schema",
    severity="error",
    summary="The type of a joint is missing or unknown",
    reason=("Nobody can say how such a joint moves; PyBullet ends the whole program where the type is missing."),
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="spherical"><parent link="base"/><child link="tip"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF008"),
)
