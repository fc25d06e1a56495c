"""SDF, MJCF or anything else in place of URDF."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF002",
    name="not-a-robot",
    tier="schema",
    severity="error",
    summary="The root element is not <robot>",
    reason=(
        "Other formats (SDF, MJCF) look alike but say different things: none of their numbers may be read as those of "
        "a URDF."
    ),
    bad='<sdf version="1.7"><model name="r"><link name="base"/></model></sdf>',
    find=found_while_reading("URDF002"),
)
