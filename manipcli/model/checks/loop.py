"""Links in a circle."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF081",
    name="loop",
    tier="topology",
    severity="error",
    summary="Links form a loop",
    reason=(
        "A URDF is a tree; closed chains need another format or a mimic joint. Without a root a program finds no link "
        "at all; beside a root, PyBullet crashes."
    ),
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="a"/><link name="b"/>'
        '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
        '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF081"),
)
