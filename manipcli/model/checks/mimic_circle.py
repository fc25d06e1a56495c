"""Mimic joints that follow themselves."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF084",
    name="mimic-circle",
    tier="topology",
    severity="error",
    summary="Joints mimic each other in a circle, or one mimics itself",
    reason="No position satisfies such a coupling but by chance.",
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="continuous"><parent link="base"/><child link="tip"/><mimic joint="j"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF084"),
)
