"""Wavefront OBJ: vertices and faces; materials, textures and normals are left out."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.mesh_fault import MAX_TRIANGLES, Faces, UnusableMesh


def read_obj(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """Vertices (n, 3), triangles (m, 3) (a polygon becomes a fan), and the first triangle of each object or group.

    Raises:
        UnusableMesh: a line that is none of an OBJ file, or too many triangles.
    """
    if b"\0" in data:
        raise UnusableMesh("is no OBJ file: it holds binary data")
    vertices: list[list[bytes]] = []
    faces: list[tuple[int, int, int]] = []
    parts: list[int] = []
    at = 0
    try:
        for at, line in enumerate(  # noqa: B007 (told in the error)
            data.replace(b"\\\n", b" ").replace(b"\\\r\n", b" ").splitlines(), start=1
        ):
            words = line.split()
            if not words:
                continue
            match words[0]:
                case b"v":
                    vertices.append(words[1:4])
                case b"f":
                    count = len(vertices)
                    corners = [_index(word, count) for word in words[1:]]
                    faces += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
                    if len(faces) > MAX_TRIANGLES:
                        raise UnusableMesh(f"has more than {MAX_TRIANGLES} triangles")
                case b"o" | b"g":
                    parts.append(len(faces))
                case _:
                    pass
        points = np.array(vertices, dtype=np.float64).reshape(-1, 3) if vertices else np.empty((0, 3))
    except ValueError as error:
        raise UnusableMesh(f"is damaged near line {at}: {error}") from error
    if not vertices:
        raise UnusableMesh("is no OBJ file: no line of it is a vertex")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    return points, triangles, tuple(sorted({0, *(part for part in parts if part < len(faces))}))


def _index(word: bytes, count: int) -> int:
    """From 0; `count` vertices stand above the line, and a negative index counts back from them."""
    index = int(word.partition(b"/")[0])
    if index == 0:
        raise ValueError("vertices are counted from 1, not 0")
    if abs(index) > 1 << 40 or index < -count:
        raise ValueError(f"vertex {index} of {count}")
    return index - 1 if index > 0 else count + index


def obj(vertices: Array, faces: Faces, parts: tuple[int, ...]) -> bytes:
    """The file of a mesh, an object for each part."""
    lines = ["v " + " ".join(map(repr, row)) for row in vertices.tolist()]
    triangles = ["f " + " ".join(map(str, row)) for row in (faces + 1).tolist()]
    for k, (first, last) in enumerate(zip(parts, (*parts[1:], len(triangles)), strict=True)):
        lines += [f"o part{k}", *triangles[first:last]]
    return "\n".join([*lines, ""]).encode()
