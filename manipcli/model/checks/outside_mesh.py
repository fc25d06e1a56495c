"""Meshes outside of what belongs to the description."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_link

CHECK = Check(
    code="URDF202",
    name="outside-mesh",
    tier="assets",
    severity="error",
    summary="A mesh lies outside of the description's folder and packages",
    reason=(
        "A description from somewhere else could name any file of this machine; links are followed before that is "
        "judged. `--allow-outside` permits it."
    ),
    bad=one_link('filename="/etc/passwd"'),
    find=found_while_reading("URDF202"),
)
