"""Coloured surfaces of mesh files: the triangles of `shapes` with the colours of the file."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from manipcli.render.surface import Surface, smoothed
from manipcli.shapes.mesh import TriangleMesh, read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Rgba

MAX_MATERIAL_BYTES = 1_000_000


def mesh_surfaces(path: Path) -> tuple[Surface, ...]:
    """The surfaces of a mesh file in its own frame, unscaled; one per colour.

    Raises:
        UnusableMesh: the file is missing, of an unknown kind, damaged or empty.
    """
    try:
        mesh = read_mesh(path)
    except UnusableMesh as error:
        raise UnusableMesh(f"'{path.name}' {error.reason}") from error
    return _surfaces(path, mesh)


@lru_cache(maxsize=64)
def _surfaces(path: Path, mesh: TriangleMesh) -> tuple[Surface, ...]:
    """Cached: the reader returns the same mesh object while the file does not change."""
    colours = mesh.colours or (tuple(_obj_colours(path)) if mesh.format == "obj" else ())
    faces: dict[Rgba | None, list[slice]] = {}
    for (first, rgba), (last, _) in pairwise([*(colours or ((0, None),)), (len(mesh.faces), None)]):
        faces.setdefault(rgba, []).append(slice(first, last))
    made = [
        smoothed(mesh.vertices, np.concatenate([mesh.faces[part] for part in parts]), rgba)
        for rgba, parts in faces.items()
    ]
    return tuple(coloured for coloured in made if len(coloured.faces))


def _obj_colours(path: Path) -> Iterator[tuple[int, Rgba | None]]:
    """Ranges of faces with one colour of an OBJ file with a material file next to it; textures are ignored."""
    known: dict[bytes, Rgba] = {}
    yield 0, None
    face = 0
    for line in path.read_bytes().splitlines():
        word, _, rest = line.strip().partition(b" ")
        if word == b"f":
            face += max(0, len(rest.split()) - 2)
        elif word == b"mtllib":
            known |= _materials(path.parent / Path(rest.strip().decode(errors="replace")).name)
        elif word == b"usemtl":
            yield face, known.get(rest.strip())


def _materials(path: Path) -> dict[bytes, Rgba]:
    """Diffuse colours of an MTL file by material name; empty if it cannot be read."""
    found: dict[bytes, Rgba] = {}
    try:
        if not path.is_file() or path.is_symlink() or path.stat().st_size > MAX_MATERIAL_BYTES:
            return found
        lines = path.read_bytes().splitlines()
    except (OSError, ValueError):
        return found
    name, alpha = b"", 1.0
    for line in lines:
        word, _, rest = line.strip().partition(b" ")
        try:
            if word == b"newmtl":
                name, alpha = rest.strip(), 1.0
            elif word == b"Kd":
                r, g, b = (min(max(float(value), 0.0), 1.0) for value in rest.split()[:3])
                found[name] = (r, g, b, alpha)
            elif word == b"d":
                alpha = min(max(float(rest), 0.0), 1.0)
                found[name] = (*found[name][:3], alpha) if name in found else (0.8, 0.8, 0.8, alpha)
        except ValueError:
            continue
    return found
