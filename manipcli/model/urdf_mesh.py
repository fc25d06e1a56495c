"""<mesh>: the file is found, belongs to the description, and for a collision can be used."""

from __future__ import annotations

from typing import Final

from manipcli.model.located_xml import Element
from manipcli.model.mesh import mesh_facts
from manipcli.model.mesh_formats import UnusableMesh
from manipcli.model.packages import Absent, NotFound, Outside, Packages, RemoteFile
from manipcli.model.robot import Mesh
from manipcli.model.urdf_numbers import Reader

WITHOUT_IT: Final = (
    "put the file there, or a <box>, <cylinder> or the mesh of the <visual> in its place, or take the <collision> out: "
    "the link then touches nothing"
)


def read_mesh_element(reader: Reader, element: Element, tag: str, packages: Packages) -> Mesh | None:
    """The mesh that `element` names, below a <visual> or <collision> (`tag`); None, with a finding, for none."""
    uri = reader.name(element, "filename")
    scale = reader.numbers(element, "scale", 3) if "scale" in element.attributes else (1.0, 1.0, 1.0)
    if uri is None or scale is None:
        return None
    if 0.0 in scale:
        reader.report("URDF012", "a mesh is scaled by 0", element.place)
        return None
    try:
        path = packages.resolve(uri)
    except (Outside, RemoteFile) as error:
        code = "URDF202" if isinstance(error, Outside) else "URDF201"
        reader.report(code, f"{tag} mesh: {error.message}", element.place, hint=error.hint)
        return None
    except NotFound as error:
        if tag == "collision":
            hint = error.hint
            if isinstance(error, Absent):
                hint = f"{hint} Else: {WITHOUT_IT}" if hint else WITHOUT_IT
            reader.report("URDF013", f"collision mesh: {error.message}", element.place, hint=hint)
        else:
            message = f"visual mesh, left out: {error.message}"
            reader.report("URDF033", message, element.place, hint=error.hint, severity="warning")
        return None
    if tag == "collision" and packages.reads and not _usable(reader, element, uri, packages):
        return None
    return Mesh(uri=packages.portable(path), path=path, scale=(scale[0], scale[1], scale[2]))


def _usable(reader: Reader, element: Element, uri: str, packages: Packages) -> bool:
    try:
        facts = mesh_facts(packages.resolve(uri))
    except UnusableMesh as error:
        reader.report("URDF200", f"collision mesh '{uri}' {error.reason}", element.place, hint=error.hint)
        return False
    if facts.flat:
        message = f"collision mesh '{uri}' is flat: nothing can be inside of it"
        reader.report("URDF210", message, element.place, hint="use a thin <box>")
    return not facts.flat
