"""Too few or too many numbers."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF058",
    name="number-count",
    tier="schema",
    severity="error",
    summary="A value has too few or too many numbers",
    reason=(
        "PyBullet takes a vector of two or four numbers for 0 0 0 without a word: a link then sits where its parent is."
    ),
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/>'
        '<origin xyz="0 0.1"/></joint>'
        "</robot>"
    ),
    find=found_while_reading("URDF058"),
)
