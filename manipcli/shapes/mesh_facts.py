"""What is worth knowing about a mesh file without holding its triangles."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.shapes.mesh import Format, read_mesh
from manipcli.shapes.mesh_fault import UnusableMesh


@dataclass(frozen=True, slots=True)
class MeshFacts:
    """`low`, `high`: corners (3,) of its box, unscaled, in its frame; `flat`: its vertices span no volume."""

    format: Format
    triangles: int
    low: Array
    high: Array
    flat: bool
    up_axis: str


def mesh_facts(path: Path) -> MeshFacts:
    """The facts of a file; one that did not change is read once.

    Raises:
        UnusableMesh: it holds no mesh that can be used.
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
    """Lowest and highest corner (3,) of a box after scaling; a negative scale mirrors it."""
    corners = np.stack([low * np.array(scale), high * np.array(scale)])
    return corners.min(axis=0), corners.max(axis=0)
