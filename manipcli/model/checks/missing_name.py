"""Names that are missing or cannot be used."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF003",
    name="missing-name",
    tier="schema",
    severity="error",
    summary="A name or reference is missing, empty or not printable",
    reason=(
        "Links, joints and meshes are found by name; PyBullet calls every link without a name the same and joins the "
        "wrong ones."
    ),
    bad=('<robot name="r"><link name="base"/><link/></robot>'),
    find=found_while_reading("URDF003"),
)
