"""Reader and writer of STL (binary and ASCII) and OBJ as bytes, with reasons for rejected files.

trimesh is not used: its import takes 0.4 s, and it reads 17 of 22 damaged test files as an empty or wrong mesh without
an error.
"""

from __future__ import annotations

import re

import numpy as np

from manipcli.core.geometry import Array
from manipcli.shapes.primitives import Rgba

MAX_BYTES = 256_000_000
MAX_TRIANGLES = 2_000_000

Faces = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
"""(m, 3): each row the vertices of a triangle."""
Colours = tuple[tuple[int, Rgba | None], ...]
"""Index of the first face of each run of one colour, with the colour (0 to 1) or None."""


class UnusableMesh(Exception):
    """A mesh file cannot be used; the caller, which knows the place, turns it into a finding.

    `reason` continues a sentence that begins with the file name.
    """

    def __init__(self, reason: str, *, hint: str | None = None) -> None:
        self.reason = reason
        self.hint = hint
        super().__init__(reason)


HEADER = 84
TRIANGLE = 50
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def is_binary_stl(data: bytes) -> bool:
    """Whether the count in the header matches the file size."""
    return len(data) >= HEADER and len(data) == HEADER + TRIANGLE * int.from_bytes(data[80:84], "little")


def is_ascii_stl(data: bytes) -> bool:
    return data[:64].lstrip().lower().startswith(b"solid") and b"facet" in data[:4096].lower()


def read_binary_stl(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """Vertices (3 m, 3), three per triangle; faces (m, 3); parts (always one).

    Raises:
        UnusableMesh: truncated, or longer than its header declares.
    """
    if len(data) < HEADER:
        raise UnusableMesh(f"is not an STL file: {len(data)} bytes are less than its header of {HEADER}")
    count = int.from_bytes(data[80:84], "little")
    expected = HEADER + TRIANGLE * count
    if expected != len(data):
        how = "is truncated" if expected > len(data) else "is damaged"
        raise UnusableMesh(f"{how}: {count} triangles take {expected} bytes, the file has {len(data)}")
    if count > MAX_TRIANGLES:
        raise UnusableMesh(f"has {count} triangles; at most {MAX_TRIANGLES} are allowed")
    corners = np.frombuffer(data, dtype=_RECORD, offset=HEADER)["corners"].astype(np.float64)
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int64).reshape(-1, 3), (0,)


def read_ascii_stl(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """Like `read_binary_stl`.

    Raises:
        UnusableMesh: not three numbers per `vertex`, not three vertices per facet, or truncated.
    """
    rows = [line.split()[1:] for line in data.splitlines() if line.lstrip()[:7].lower().rstrip() == b"vertex"]
    if len(rows) > 3 * MAX_TRIANGLES:
        raise UnusableMesh(f"has {len(rows) // 3} triangles; at most {MAX_TRIANGLES} are allowed")
    if b"endsolid" not in data[-1024:].lower():
        raise UnusableMesh("is truncated: 'endsolid' is missing")
    try:
        vertices = np.array(rows, dtype=np.float64).reshape(-1, 3) if rows else np.empty((0, 3))
    except ValueError as error:
        raise UnusableMesh("is damaged: a 'vertex' does not have 3 numbers") from error
    if len(vertices) % 3 or any(len(row) != 3 for row in rows):
        raise UnusableMesh(f"is damaged: {len(rows)} vertices are not a whole number of triangles")
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3), (0,)


def binary_stl(corners: Array) -> bytes:
    """A binary STL file of triangles `corners` (m, 3, 3), with zero normals."""
    records = np.zeros(len(corners), dtype=_RECORD)
    records["corners"] = corners
    return b"manipcli".ljust(80, b" ") + len(corners).to_bytes(4, "little") + records.tobytes()


_BEHIND_SLASH = re.compile(rb"/\S*")


def read_obj(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """Vertices (n, 3), triangles (m, 3) (a polygon becomes a fan), and the first triangle of each object or group.

    Raises:
        UnusableMesh: binary data, no vertices, invalid vertices or faces, or too many triangles.
    """
    if b"\0" in data:
        raise UnusableMesh("is not an OBJ file: it contains binary data")
    vertices: list[bytes] = []
    faces: list[bytes] = []
    above: list[int] = []  # number of vertices before each face, from which negative indices count back
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
        raise UnusableMesh("is not an OBJ file: it has no vertices")
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
        raise UnusableMesh("is damaged: a vertex does not have 3 numbers") from error


def _triangles(lines: list[bytes], above: list[int]) -> tuple[Faces, Faces]:
    """(m, 3) vertex indices from 0, and the index of the first triangle of each face."""
    corners = np.array([len(line.split()) for line in lines], dtype=np.int64)
    count = np.maximum(corners - 2, 0)
    first = np.concatenate(([0], np.cumsum(count)))
    if first[-1] > MAX_TRIANGLES:
        raise UnusableMesh(f"has {first[-1]} triangles; at most {MAX_TRIANGLES} are allowed")
    try:
        index = np.array(_BEHIND_SLASH.sub(b"", b" ".join(lines)).split(), dtype=np.int64)
    except (ValueError, OverflowError) as error:
        raise UnusableMesh("is damaged: a vertex index of a face is not a whole number") from error
    if len(index) != corners.sum():
        raise UnusableMesh("is damaged: a vertex index of a face is missing before '/'")
    known = np.repeat(np.array(above, dtype=np.int64), corners)
    bad = (index == 0) | (index < -known)
    if bad.any():
        k = int(np.argmax(bad))
        face = int(np.searchsorted(np.cumsum(corners), k, side="right"))
        raise UnusableMesh(f"is damaged: face {face + 1} has vertex {index[k]} of {known[k]}")
    index = np.where(index > 0, index - 1, known + index)
    # A polygon (a, b, c, d) is the fan (a, b, c), (a, c, d): triangle k of a face has the corners 0, k + 1, k + 2.
    face_of = np.repeat(np.arange(len(lines)), count)
    start = (np.cumsum(corners) - corners)[face_of]
    step = np.arange(int(first[-1])) - first[face_of]
    return index[np.stack([start, start + step + 1, start + step + 2], axis=1)], first


def obj(vertices: Array, faces: Faces, parts: tuple[int, ...]) -> bytes:
    """An OBJ file with one object per part."""
    lines = ["v " + " ".join(map(repr, row)) for row in vertices.tolist()]
    triangles = ["f " + " ".join(map(str, row)) for row in (faces + 1).tolist()]
    for k, (first, last) in enumerate(zip(parts, (*parts[1:], len(triangles)), strict=True)):
        lines += [f"o part{k}", *triangles[first:last]]
    return "\n".join([*lines, ""]).encode()
