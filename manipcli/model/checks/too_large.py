"""Files beyond what a description can be."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF052",
    name="too-large",
    tier="schema",
    severity="error",
    summary="The file, its depth or its number of elements is beyond a bound",
    reason=(
        "Descriptions come from anywhere; one that was made to exhaust memory or the stack of a parser is stopped "
        "early."
    ),
    bad=(f'<robot name="r">{"<link>" * 120}{"</link>" * 120}</robot>'),
    find=found_while_reading("URDF052"),
)
