"""Mesh files for engines: written by us from triangles that were checked, into a folder of the engine's own.

An engine crashes on a damaged file, drops a text STL without a word, and reads past the end of an OBJ with a bad index;
it gets none of them.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from manipcli.core.errors import Finding, InvalidInput
from manipcli.shapes.mesh import TriangleMesh, read_mesh
from manipcli.shapes.mesh_fault import UnusableMesh
from manipcli.shapes.mesh_obj import obj
from manipcli.shapes.mesh_stl import binary_stl
from manipcli.shapes.primitives import Mesh


def clean_mesh(mesh: Mesh, folder: Path) -> Path:
    """A new file in `folder` with the triangles of `mesh`, unscaled: OBJ for OBJ, as its parts count, else binary STL.

    Raises:
        InvalidInput: the file of the mesh cannot be used.
    """
    try:
        triangles = read_mesh(mesh.path)
    except UnusableMesh as error:
        message = f"mesh '{mesh.uri}' {error.reason}"
        raise InvalidInput([Finding("URDF200", message, hint=error.hint)]) from error
    suffix = ".obj" if triangles.format == "obj" else ".stl"
    name = hashlib.sha256(str(mesh.path).encode("utf-8", "surrogateescape")).hexdigest()[:16]
    path = folder / (name + suffix)
    if not path.exists():
        path.write_bytes(_bytes(triangles))
    return path


def _bytes(mesh: TriangleMesh) -> bytes:
    if mesh.format == "obj":
        return obj(mesh.vertices, mesh.faces, mesh.parts)
    return binary_stl(mesh.vertices[mesh.faces])
