"""Links that hang on two joints."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF082",
    name="two-parents",
    tier="topology",
    severity="error",
    summary="A link is the child of two joints",
    reason="A URDF is a tree: the second joint closes a chain. PyBullet crashes on it.",
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/></joint>'
        '<joint name="k" type="fixed"><parent link="base"/><child link="tip"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF082"),
)
