"""Reader of mesh files: format detection by content, bounded sizes, no external references; writer for engines.

An engine crashes on a damaged file, silently drops an ASCII STL, and reads past the end of an OBJ with a bad index.
Engines therefore get files that `clean_mesh` writes from validated triangles.
"""

from __future__ import annotations

import functools
import hashlib
import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.geometry import Array, frozen
from manipcli.shapes.mesh_collada import read_collada
from manipcli.shapes.mesh_formats import (
    MAX_BYTES,
    MAX_TRIANGLES,
    Colours,
    Faces,
    UnusableMesh,
    binary_stl,
    is_ascii_stl,
    is_binary_stl,
    obj,
    read_ascii_stl,
    read_binary_stl,
    read_obj,
)
from manipcli.shapes.primitives import Mesh

SUFFIXES = {".stl": "stl", ".obj": "obj", ".dae": "collada"}
"""Supported formats by suffix."""

Format = Literal["stl", "stl-ascii", "obj", "collada"]


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles in the frame of the file, in its unit (Collada: in metres).

    Attributes:
        vertices: (n, 3), finite.
        faces: (m, 3) integers, each row the vertices of a triangle.
        parts: index of the first face of each part; an engine builds a hull per part.
        format: of the content.
        up_axis: as written in a Collada file, "" if missing; it is not applied.
        colours: colours of the faces in the file.
    """

    vertices: Array
    faces: Faces
    parts: tuple[int, ...]
    format: Format
    up_axis: str = "Z_UP"
    colours: Colours = ()

    @functools.cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner (3,) of the bounding box of all triangles."""
        used = self.vertices[self.faces.ravel()]
        return used.min(axis=0), used.max(axis=0)

    @functools.cached_property
    def flat(self) -> bool:
        """Whether all triangles lie in a plane, on a line or at a point, so that the hull has no volume."""
        used = self.vertices[np.unique(self.faces)]
        spread = np.linalg.svd(used - used.mean(axis=0), compute_uv=False)
        return len(used) < 4 or bool(spread[2] <= 1e-9 * spread[0])


@dataclass(frozen=True, slots=True)
class MeshFacts:
    """`low`, `high`: corners (3,) of the bounding box, unscaled, in the mesh frame; `flat`: without volume."""

    format: Format
    triangles: int
    low: Array
    high: Array
    flat: bool
    up_axis: str


def read_mesh(path: Path) -> TriangleMesh:
    """The triangles of an STL (binary or ASCII), OBJ or Collada file; unchanged files are cached.

    Raises:
        UnusableMesh: not a regular file, too large, in another format, damaged, or without triangles.
    """
    try:
        info = path.stat()
        if not stat.S_ISREG(info.st_mode):
            raise UnusableMesh("is not a regular file")
    except (OSError, ValueError) as error:
        raise UnusableMesh(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if info.st_size > MAX_BYTES:
        raise UnusableMesh(f"has {info.st_size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} MB are allowed")
    if info.st_size == 0:
        raise UnusableMesh("is empty")
    found = _read(path.resolve(), info.st_mtime_ns, info.st_size)
    if isinstance(found, TriangleMesh):
        return found
    raise UnusableMesh(found[0], hint=found[1])


@functools.lru_cache(maxsize=64)
def _read(path: Path, _changed: int, _size: int) -> TriangleMesh | tuple[str, str | None]:
    """The mesh, or reason and hint, which are cached unlike exceptions."""
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise UnusableMesh(f"has more than {MAX_BYTES / 1e6:.0f} MB")
        return _checked(*_parsed(data, path.suffix.lower()))
    except UnusableMesh as error:
        return error.reason, error.hint
    except OSError as error:
        return f"cannot be read: {error.strerror}", None
    except MemoryError:
        return "does not fit into memory", None


def mesh_facts(path: Path) -> MeshFacts:
    """The facts of a mesh file; unchanged files are cached.

    Raises:
        UnusableMesh: as `read_mesh`.
    """
    try:
        info = path.stat()
    except (OSError, ValueError) as error:
        raise UnusableMesh(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    found = _facts(path, info.st_mtime_ns, info.st_size)
    if isinstance(found, MeshFacts):
        return found
    raise UnusableMesh(found[0], hint=found[1])


@functools.lru_cache(maxsize=4096)
def _facts(path: Path, _changed: int, _size: int) -> MeshFacts | tuple[str, str | None]:
    try:
        mesh = read_mesh(path)
    except UnusableMesh as error:
        return error.reason, error.hint
    low, high = mesh.bounds
    return MeshFacts(mesh.format, len(mesh.faces), frozen(low), frozen(high), mesh.flat, mesh.up_axis)


def scaled_box(low: Array, high: Array, scale: tuple[float, float, float]) -> tuple[Array, Array]:
    """Lowest and highest corner (3,) of a scaled box; a negative scale mirrors it."""
    corners = np.stack([low * np.array(scale), high * np.array(scale)])
    return corners.min(axis=0), corners.max(axis=0)


_BEGINS_AS_OBJ: Final = re.compile(rb"(\s*(#|o |g |s |mtllib |usemtl )[^\n]*\n)*\s*v\s+-?[0-9.]")
_OTHERS: Final = {
    b"\x89png": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"gltf": "a glTF file",
    b"ply\n": "a PLY file",
    b"ply\r": "a PLY file",
    b"pk\x03\x04": "a ZIP archive",
    b"\x1f\x8b": "a gzip archive",
    b"iso-10303": "a STEP file",
    b"%pdf": "a PDF document",
}
"""Other formats by their first bytes, in lower case."""


def _other_format(head: bytes) -> str | None:
    return next((name for begins, name in _OTHERS.items() if head.startswith(begins)), None)


Parsed = tuple[Format, Array, Faces, tuple[int, ...], str, Colours]


def _parsed(data: bytes, suffix: str) -> Parsed:
    head = data[:512].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if head.startswith(b"version https://git-lfs"):
        raise UnusableMesh("is a Git LFS pointer, not the mesh itself", hint="fetch it: git lfs pull")
    if head.startswith((b"<!doctype html", b"<html")):
        raise UnusableMesh("is a web page, not a mesh", hint="download the file itself")
    if is_binary_stl(data):
        return ("stl", *read_binary_stl(data), "Z_UP", ())
    if is_ascii_stl(data):
        return ("stl-ascii", *read_ascii_stl(data), "Z_UP", ())
    if head.startswith((b"<?xml", b"<collada", b"<!doctype")):
        return ("collada", *read_collada(data))
    if other := _other_format(head):
        raise UnusableMesh(f"is {other}, not a mesh", hint=f"convert it to one of {', '.join(SUFFIXES)}")
    if suffix == ".stl" and _BEGINS_AS_OBJ.match(data[:4096]):
        raise UnusableMesh("contains OBJ, not STL", hint="rename it to *.obj")
    if suffix == ".stl":
        return ("stl", *read_binary_stl(data), "Z_UP", ())
    if suffix == ".dae":
        raise UnusableMesh("is not a Collada file: it is not XML")
    if suffix == ".obj":
        return ("obj", *read_obj(data), "Z_UP", ())
    known = ", ".join(SUFFIXES)
    raise UnusableMesh(f"has the unsupported format '{suffix}'; expected one of {known}", hint="convert it")


def _checked(
    kind: Format, vertices: Array, faces: Faces, parts: tuple[int, ...], up_axis: str, colours: Colours
) -> TriangleMesh:
    if len(faces) == 0:
        raise UnusableMesh("has no triangles")
    if len(faces) > MAX_TRIANGLES:
        raise UnusableMesh(f"has {len(faces)} triangles; at most {MAX_TRIANGLES} are allowed")
    if int(faces.min()) < 0 or int(faces.max()) >= len(vertices):
        k = int(np.argmax((faces < 0).any(axis=1) | (faces >= len(vertices)).any(axis=1)))
        at = ", ".join(str(index) for index in faces[k])
        raise UnusableMesh(f"is damaged: triangle {k + 1} has vertices {at} of {len(vertices)}")
    # Larger numbers overflow in an engine, which squares them in single precision.
    bad = ~(np.abs(vertices) < 1e15).all(axis=1)
    if bad.any():
        k = int(np.argmax(bad))
        at = ", ".join(f"{value:g}" for value in vertices[k])
        raise UnusableMesh(f"is damaged: vertex {k + 1} is at ({at})")
    mesh = TriangleMesh(
        vertices=frozen(vertices), faces=faces, parts=parts, format=kind, up_axis=up_axis, colours=colours
    )
    low, high = mesh.bounds
    if not (high > low).any():
        raise UnusableMesh("is damaged: all triangles are at one point")
    mesh.faces.flags.writeable = False
    return mesh


def clean_mesh(mesh: Mesh, folder: Path) -> Path:
    """A new file in `folder` with the unscaled triangles of `mesh`: OBJ for OBJ, to keep its parts, else binary STL.

    Of a mesh with a `part`, only that part; its file is not read.

    Raises:
        InvalidInput: the mesh file cannot be used.
    """
    if mesh.part is not None:
        corners = np.array(mesh.part.points)[np.array(mesh.part.triangles)]
        content = binary_stl(corners)
        path = folder / f"{hashlib.sha256(content).hexdigest()[:16]}.stl"
        path.write_bytes(content)
        return path
    try:
        triangles = read_mesh(mesh.path)
    except UnusableMesh as error:
        message = f"mesh '{mesh.uri}' {error.reason}"
        raise InvalidInput([Diagnostic("URDF200", message, hint=error.hint)]) from error
    suffix = ".obj" if triangles.format == "obj" else ".stl"
    name = hashlib.sha256(str(mesh.path).encode("utf-8", "surrogateescape")).hexdigest()[:16]
    path = folder / (name + suffix)
    if not path.exists():
        is_obj = triangles.format == "obj"
        corners = triangles.vertices[triangles.faces]
        path.write_bytes(obj(triangles.vertices, triangles.faces, triangles.parts) if is_obj else binary_stl(corners))
    return path
