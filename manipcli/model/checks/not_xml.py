"""A file that is no XML."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF001",
    name="not-xml",
    tier="schema",
    severity="error",
    summary="The file cannot be read as XML",
    reason="Nothing of such a file can be trusted: parsers that go on anyway lose what follows the mistake.",
    bad=('<robot name="r"><link name="base"></robot>'),
    find=found_while_reading("URDF001"),
)
