"""Mimic joints that follow nobody."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF014",
    name="mimic-target",
    tier="topology",
    severity="error",
    summary="A mimic joint follows a joint that is not there or does not move, or multiplies it by 0",
    reason="The joint would be free where the robot has a coupling: half of a gripper hangs loose.",
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="continuous"><parent link="base"/><child link="tip"/><mimic joint="k"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF014"),
)
