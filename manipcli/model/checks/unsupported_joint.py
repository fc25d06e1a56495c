"""Joints of several degrees of freedom."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF065",
    name="unsupported-joint",
    tier="schema",
    severity="warning",
    summary="A joint of several degrees of freedom is held fixed",
    reason=(
        "Floating and planar joints say that something else moves the link. PyBullet makes a floating joint a fixed "
        "one without a word, and gives a planar one no axis; so does manipcli hold it, but says it."
    ),
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="floating"><parent link="base"/><child link="tip"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF065"),
)
