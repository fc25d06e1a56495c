"""Shapes that other programs understand."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF062",
    name="foreign-shape",
    tier="schema",
    severity="warning",
    summary="A shape is not one of URDF",
    reason=(
        "Each program knows other extensions and drops the rest: a capsule is two spheres and a cylinder; use those."
    ),
    bad=(
        '<robot name="r">'
        '<link name="base"><collision><geometry>'
        '<capsule radius="0.1" length="1"/></geometry></collision></link>'
        "</robot>"
    ),
    find=found_while_reading("URDF062"),
)
