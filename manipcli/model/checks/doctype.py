"""Declarations of a document type, and the entities they bring."""

from manipcli.model.check import Check, found_while_reading

CHECK = Check(
    code="URDF051",
    name="doctype",
    tier="schema",
    severity="error",
    summary="The file has a DOCTYPE",
    reason=(
        "Entities declared there can blow a small file up to gigabytes or read other files. A description needs none, "
        "and parsers disagree on them: PyBullet ignores them without a word."
    ),
    bad=('<!DOCTYPE robot [<!ENTITY size "0.1">]><robot name="r"><link name="base"/></robot>'),
    find=found_while_reading("URDF051"),
)
