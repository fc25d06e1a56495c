"""Names that are used twice."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF005",
    name="duplicate-name",
    tier="topology",
    severity="error",
    summary="Two links or two joints have the same name",
    reason=("Which of the two is meant depends on the program; PyBullet crashes on a joint that is there twice."),
    bad=('<robot name="r"><link name="base"/><link name="base"/></robot>'),
    find=found_while_reading("URDF005"),
)
