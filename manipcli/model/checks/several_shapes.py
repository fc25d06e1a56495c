"""Several shapes in one geometry."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF061",
    name="several-shapes",
    tier="schema",
    severity="warning",
    summary="A geometry has more than one shape",
    reason=("Programs read the first and lose the others: what is drawn or collides is less than what was written."),
    bad=(
        '<robot name="r">'
        '<link name="base"><visual><geometry>'
        '<box size="1 1 1"/><sphere radius="1"/></geometry></visual></link>'
        "</robot>"
    ),
    find=found_while_reading("URDF061"),
)
