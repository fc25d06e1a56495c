"""Shapes that are missing, unknown or of no size."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF012",
    name="shape",
    tier="schema",
    severity="error",
    summary="A geometry has no shape, an unknown one, or one without extent",
    reason=(
        "PyBullet takes a size of 0 or less without a word and gives the link no inertia; without a shape nothing "
        "collides."
    ),
    bad=('<robot name="r"><link name="base"><collision><geometry/></collision></link></robot>'),
    find=found_while_reading("URDF012"),
)
