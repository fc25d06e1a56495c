"""Links that are not joined to the rest."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF007",
    name="several-roots",
    tier="topology",
    severity="error",
    summary="The description has more than one root link",
    reason=("A description is one tree. PyBullet crashes on two; other programs keep the first and lose the rest."),
    bad=('<robot name="r"><link name="base"/><link name="lost"/></robot>'),
    find=found_while_reading("URDF007"),
)
