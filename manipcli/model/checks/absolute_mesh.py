"""Meshes named by an absolute path."""

from collections.abc import Iterator
from pathlib import PurePosixPath, PureWindowsPath

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import one_link


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        uri = mesh.uri
        windows = bool(PureWindowsPath(uri).drive)
        if uri.startswith("file:") or PurePosixPath(uri).is_absolute() or windows:
            message = f"mesh '{uri}' is named by an absolute path, which no other machine has"
            yield Finding(
                "URDF204", message, mesh.element.place, "use package://NAME/path or a relative path", "warning"
            )


CHECK = Check(
    code="URDF204",
    name="absolute-mesh",
    tier="assets",
    severity="warning",
    summary="A mesh is named by an absolute path",
    reason="The description works on the machine it was written on and on no other.",
    bad=one_link('filename="file:///home/somebody/robot/base.stl"'),
    find=_find,
)
