"""Text where a number belongs."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF004",
    name="bad-number",
    tier="schema",
    severity="error",
    summary="A value is not a finite number, or larger than anything real",
    reason=(
        "PyBullet reads text, a decimal comma and a missing value as 0 without a word, and nan, inf or what is too "
        "large for single precision makes every state nan from the first step."
    ),
    bad=(
        '<robot name="r">'
        '<link name="base"><inertial><mass value="heavy"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        "</robot>"
    ),
    find=found_while_reading("URDF004"),
)
