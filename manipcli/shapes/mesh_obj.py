"""Wavefront OBJ: vertices and faces; materials, textures and normals are left out."""

from __future__ import annotations

import re

import numpy as np

from manipcli.core.geometry import Array
from manipcli.shapes.mesh_fault import MAX_TRIANGLES, Faces, UnusableMesh

_BEHIND_SLASH = re.compile(rb"/\S*")


def read_obj(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """Vertices (n, 3), triangles (m, 3) (a polygon becomes a fan), and the first triangle of each object or group.

    Raises:
        UnusableMesh: a line that is none of an OBJ file, or too many triangles.
    """
    if b"\0" in data:
        raise UnusableMesh("is no OBJ file: it holds binary data")
    vertices: list[bytes] = []
    faces: list[bytes] = []
    above: list[int] = []  # how many vertices stand above a face: from these, negative indices count back
    parts: list[int] = []
    for line in data.replace(b"\\\n", b" ").replace(b"\\\r\n", b" ").splitlines():
        kind, _, rest = line.lstrip().replace(b"\t", b" ").partition(b" ")
        if kind == b"v":
            vertices.append(rest)
        elif kind == b"f":
            faces.append(rest)
            above.append(len(vertices))
        elif kind in (b"o", b"g"):
            parts.append(len(faces))
    if not vertices:
        raise UnusableMesh("is no OBJ file: no line of it is a vertex")
    points = _points(vertices)
    triangles, first = _triangles(faces, above)
    starts = {0, *(int(first[part]) for part in parts if part < len(faces))}
    return points, triangles, tuple(sorted(start for start in starts if start < len(triangles) or start == 0))


def _points(lines: list[bytes]) -> Array:
    """The first three numbers of each line; weights and colours may follow."""
    try:
        values = np.array(b" ".join(lines).split(), dtype=np.float64)
        if len(values) == 3 * len(lines) and all(len(line.split()) == 3 for line in lines):
            return values.reshape(-1, 3)
        return np.array([line.split()[:3] for line in lines], dtype=np.float64).reshape(len(lines), 3)
    except ValueError as error:
        raise UnusableMesh("is damaged: a vertex has not three numbers") from error


def _triangles(lines: list[bytes], above: list[int]) -> tuple[Faces, Faces]:
    """(m, 3), vertices counted from 0; and of each face the number of its first triangle."""
    corners = np.array([len(line.split()) for line in lines], dtype=np.int64)
    count = np.maximum(corners - 2, 0)
    first = np.concatenate(([0], np.cumsum(count)))
    if first[-1] > MAX_TRIANGLES:
        raise UnusableMesh(f"has {first[-1]} triangles; at most {MAX_TRIANGLES} are read")
    try:
        index = np.array(_BEHIND_SLASH.sub(b"", b" ".join(lines)).split(), dtype=np.int64)
    except (ValueError, OverflowError) as error:
        raise UnusableMesh("is damaged: a face names a vertex by what is no whole number") from error
    if len(index) != corners.sum():
        raise UnusableMesh("is damaged: a face names a vertex by nothing but a slash")
    known = np.repeat(np.array(above, dtype=np.int64), corners)
    bad = (index == 0) | (index < -known)
    if bad.any():
        k = int(np.argmax(bad))
        face = int(np.searchsorted(np.cumsum(corners), k, side="right"))
        raise UnusableMesh(f"is damaged: face {face + 1} names vertex {index[k]} of {known[k]}")
    index = np.where(index > 0, index - 1, known + index)
    # A polygon (a, b, c, d) is the fan (a, b, c), (a, c, d): triangle k of a face has its corners 0, k + 1, k + 2.
    face_of = np.repeat(np.arange(len(lines)), count)
    start = (np.cumsum(corners) - corners)[face_of]
    step = np.arange(int(first[-1])) - first[face_of]
    return index[np.stack([start, start + step + 1, start + step + 2], axis=1)], first


def obj(vertices: Array, faces: Faces, parts: tuple[int, ...]) -> bytes:
    """The file of a mesh, an object for each part."""
    lines = ["v " + " ".join(map(repr, row)) for row in vertices.tolist()]
    triangles = ["f " + " ".join(map(str, row)) for row in (faces + 1).tolist()]
    for k, (first, last) in enumerate(zip(parts, (*parts[1:], len(triangles)), strict=True)):
        lines += [f"o part{k}", *triangles[first:last]]
    return "\n".join([*lines, ""]).encode()
