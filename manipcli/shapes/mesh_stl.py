"""STL, binary and text."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.shapes.mesh_fault import MAX_TRIANGLES, Faces, UnusableMesh

HEADER = 84
TRIANGLE = 50
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def is_binary_stl(data: bytes) -> bool:
    """Whether the count in the header fits the size of the file, as it does in no other format by accident."""
    return len(data) >= HEADER and len(data) == HEADER + TRIANGLE * int.from_bytes(data[80:84], "little")


def is_ascii_stl(data: bytes) -> bool:
    return data[:64].lstrip().lower().startswith(b"solid") and b"facet" in data[:4096].lower()


def read_binary_stl(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """Vertices (3 m, 3), three to a triangle; faces (m, 3); one part.

    Raises:
        UnusableMesh: cut off, or longer than its header says.
    """
    if len(data) < HEADER:
        raise UnusableMesh(f"is no STL file: it has {len(data)} bytes, less than the header of one")
    count = int.from_bytes(data[80:84], "little")
    expected = HEADER + TRIANGLE * count
    if expected != len(data):
        how = "is cut off" if expected > len(data) else "is damaged"
        raise UnusableMesh(f"{how}: {count} triangles take {expected} bytes, the file has {len(data)}")
    if count > MAX_TRIANGLES:
        raise UnusableMesh(f"has {count} triangles; at most {MAX_TRIANGLES} are read")
    corners = np.frombuffer(data, dtype=_RECORD, offset=HEADER)["corners"].astype(np.float64)
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int64).reshape(-1, 3), (0,)


def read_ascii_stl(data: bytes) -> tuple[Array, Faces, tuple[int, ...]]:
    """As `read_binary_stl`.

    Raises:
        UnusableMesh: not three numbers after a `vertex`, not three vertices a facet, or cut off.
    """
    rows = [line.split()[1:] for line in data.splitlines() if line.lstrip()[:7].lower().rstrip() == b"vertex"]
    if len(rows) > 3 * MAX_TRIANGLES:
        raise UnusableMesh(f"has {len(rows) // 3} triangles; at most {MAX_TRIANGLES} are read")
    if b"endsolid" not in data[-1024:].lower():
        raise UnusableMesh("is cut off: no 'endsolid' ends it")
    try:
        vertices = np.array(rows, dtype=np.float64).reshape(-1, 3) if rows else np.empty((0, 3))
    except ValueError as error:
        raise UnusableMesh("is damaged: a 'vertex' without three numbers") from error
    if len(vertices) % 3 or any(len(row) != 3 for row in rows):
        raise UnusableMesh(f"is damaged: {len(rows)} vertices make no whole number of triangles")
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3), (0,)


def binary_stl(corners: Array) -> bytes:
    """The file of triangles `corners` (m, 3, 3); normals are left to the reader, as most do."""
    records = np.zeros(len(corners), dtype=_RECORD)
    records["corners"] = corners
    return b"manipcli".ljust(80, b" ") + len(corners).to_bytes(4, "little") + records.tobytes()
