"""Meshes that only a network could answer."""

from manipcli.model.check import Check, found_while_reading
from manipcli.model.samples import one_link

CHECK = Check(
    code="URDF201",
    name="remote-mesh",
    tier="assets",
    severity="error",
    summary="A mesh is named by http, ftp, data: or another address that is not read",
    reason="A description is data: nothing is fetched for it, and what it means may not change with a server.",
    bad=one_link('filename="https://example.org/a.stl"'),
    find=found_while_reading("URDF201"),
)
