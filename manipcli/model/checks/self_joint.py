"""Joints from a link to itself."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF083",
    name="self-joint",
    tier="topology",
    severity="error",
    summary="A joint joins a link to itself",
    reason="It says nothing about where the link is; PyBullet crashes on it.",
    bad=(
        '<robot name="r">'
        '<link name="base"/>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="base"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF083"),
)
