"""Numbers that must be there."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF059",
    name="missing-attribute",
    tier="schema",
    severity="error",
    summary="A number that must be stated is missing",
    reason="Each program has an idea of its own of what a missing value means: 0, 1, or to refuse the file.",
    bad=('<robot name="r"><link name="base"><collision><geometry><sphere/></geometry></collision></link></robot>'),
    find=found_while_reading("URDF059"),
)
