"""Joints at links that are not there."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF006",
    name="undefined-link",
    tier="topology",
    severity="error",
    summary="A joint names a link that is not in the description",
    reason="Mostly a name that was changed in one place, or a prefix that one macro lacks.",
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="fixed"><parent link="bsae"/><child link="tip"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF006"),
)
