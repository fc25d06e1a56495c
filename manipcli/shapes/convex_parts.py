"""Convex parts of a concave mesh, so that a bowl is hollow and a shelf has room.

Separate closed parts of the mesh that are convex already are taken as they are; the rest is decomposed by CoACD
(`manipcli[coacd]`), which takes seconds to minutes. The result depends on the triangles only and is kept in the cache.
"""

from __future__ import annotations

import functools
import io
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.activity import announce
from manipcli.core.cache import cache_key, read_cached, write_cached
from manipcli.core.geometry import Array
from manipcli.shapes.coacd_process import SETTINGS
from manipcli.shapes.mesh import TriangleMesh, read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import ConvexPart

Faces = npt.NDArray[np.int64]

SOLID: Final = 0.9
"""A mesh that fills at least this share of its convex hull counts as the hull by default."""
CONVEX: Final = 0.99
"""A separate part that fills at least this share of its hull is not decomposed."""
MOST_PARTS: Final = 128
MOST_TRIANGLES: Final = 50_000
PATIENCE: Final = 900.0
"""[s] after which a decomposition is given up. No result depends on it: it fails, or has always the same parts."""
LEAST_SHARE: Final = 1e-6
"""Parts with a smaller share of the whole volume are slivers, which an engine cannot use."""
HULL_HINT: Final = "install it: pip install 'manipcli[coacd]'; or use the convex hull: `collision: hull`"


def concave(path: Path) -> bool:
    """Whether a mesh fills less than the share `SOLID` of its convex hull.

    Small holes of a scanned surface count for little: what is behind a hole, seen from the middle, counts as empty. An
    open box fills 5/6, half a sphere without a lid 13/16. False for a file that cannot be used as a mesh, which has no
    parts either.
    """
    try:
        return _concave(read_mesh(path))
    except UnusableMesh:
        return False


@functools.lru_cache(maxsize=64)
def _concave(mesh: TriangleMesh) -> bool:
    """Cached, like `_parts`."""
    points, faces = _welded(mesh)
    hull = _hull(points)
    return hull is not None and abs(_volume(points, faces, hull[0].mean(axis=0))) < SOLID * hull[2]


def convex_parts(path: Path) -> tuple[ConvexPart, ...]:
    """The convex parts of a mesh, in the unscaled frame of its file.

    Raises:
        UnusableMesh: the file cannot be used, has too many triangles, or cannot be decomposed; CoACD is not installed.
    """
    return _parts(read_mesh(path), path.name)


@functools.lru_cache(maxsize=64)
def _parts(mesh: TriangleMesh, name: str) -> tuple[ConvexPart, ...]:
    """Cached: the reader returns the same mesh object while the file does not change."""
    points, faces = _welded(mesh)
    whole = _hull(points)
    if whole is None:
        raise UnusableMesh("is flat")
    separate = _separate(points, faces)
    hulls: list[Array] = []
    for part in separate:
        corners = points[np.unique(part)]
        made = _hull(corners)
        if made is not None and _closed(part) and _volume(points, part) >= CONVEX * made[2]:
            hulls.append(corners)
        elif made is not None:
            hulls += _decomposed(points, part, name)
    found = [part for part in map(_hull, hulls) if part is not None and part[2] > LEAST_SHARE * whole[2]]
    if not found:
        raise UnusableMesh("cannot be decomposed into convex parts", hint="use its convex hull: `collision: hull`")
    if len(found) > MOST_PARTS:
        raise UnusableMesh(
            f"has {len(found)} convex parts; at most {MOST_PARTS} are allowed",
            hint="simplify it, or use its convex hull: `collision: hull`",
        )
    return tuple(
        ConvexPart(k, tuple(map(_three, corners.tolist())), tuple(map(_indices, triangles.tolist())))
        for k, (corners, triangles, _) in enumerate(found)
    )


def _decomposed(points: Array, faces: Faces, name: str) -> list[Array]:
    """Corners of the parts that CoACD makes, from the cache if it was done before."""
    if len(faces) > MOST_TRIANGLES:
        raise UnusableMesh(
            f"has {len(faces)} triangles; at most {MOST_TRIANGLES} are decomposed into convex parts",
            hint="simplify it, or use its convex hull: `collision: hull`",
        )
    from importlib import metadata

    used, flat = np.unique(faces, return_inverse=True)
    vertices, triangles = np.ascontiguousarray(points[used]), flat.reshape(-1, 3).astype(np.int64)
    try:
        version = metadata.version("coacd")
    except metadata.PackageNotFoundError:
        raise UnusableMesh("is concave, and CoACD is not installed, which makes convex parts", hint=HULL_HINT) from None
    key = cache_key(version, repr(sorted(SETTINGS.items())), vertices.tobytes(), triangles.tobytes())
    stored = read_cached("convex_parts", key)
    parts = None if stored is None else _read(stored, vertices)
    if parts is None:
        announce(f"decomposing mesh '{name}' into convex parts ({len(faces)} triangles), once: the result is kept")
        content = _run(vertices, triangles)
        parts = _read(content, vertices)
        if parts is None:
            raise UnusableMesh("cannot be decomposed into convex parts", hint="use its convex hull: `collision: hull`")
        write_cached("convex_parts", key, content)
    return parts


def _run(vertices: Array, faces: Faces) -> bytes:
    """The output of CoACD for these triangles.

    Raises:
        UnusableMesh: CoACD failed or took too long.
    """
    import subprocess

    hint = "repair or simplify the mesh, or use its convex hull: `collision: hull`"
    with TemporaryDirectory(prefix="manipcli-") as folder:
        source, target = Path(folder) / "mesh.npz", Path(folder) / "parts.npz"
        np.savez(source, vertices=vertices, faces=faces)
        command = [sys.executable, "-P", "-m", "manipcli.shapes.coacd_process", str(source), str(target)]
        quiet = subprocess.DEVNULL
        try:
            subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, timeout=PATIENCE, check=True)
            return target.read_bytes()
        except subprocess.TimeoutExpired as error:
            raise UnusableMesh(f"was not decomposed into convex parts within {PATIENCE:g} s", hint=hint) from error
        except (subprocess.CalledProcessError, OSError) as error:
            raise UnusableMesh("cannot be decomposed into convex parts: CoACD failed", hint=hint) from error


def _read(content: bytes, vertices: Array) -> list[Array] | None:
    """The corners of each part; None if the content is not a decomposition of a mesh with these vertices."""
    from zipfile import BadZipFile

    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            points, counts = arrays["points"], arrays["counts"]
    except (ValueError, KeyError, OSError, EOFError, BadZipFile, MemoryError):
        return None
    if points.dtype != np.float64 or points.ndim != 2 or points.shape[1] != 3 or counts.dtype.kind not in "iu":
        return None
    if counts.ndim != 1 or not 0 < len(counts) <= MOST_PARTS or counts.min() < 0 or counts.sum() != len(points):
        return None
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    slack = 0.1 * float(np.max(high - low))
    if not (np.isfinite(points).all() and (points >= low - slack).all() and (points <= high + slack).all()):
        return None
    return np.split(points, np.cumsum(counts)[:-1])


def _welded(mesh: TriangleMesh) -> tuple[Array, Faces]:
    """Vertices (n, 3) without duplicates, and the faces between different ones: STL repeats every vertex."""
    points, index = np.unique(mesh.vertices[mesh.faces].reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3).astype(np.int64)
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[proper]
    inside_out = _closed(faces) and _volume(points, faces) < 0.0
    return points, faces[:, ::-1] if inside_out else faces


def _separate(points: Array, faces: Faces) -> list[Faces]:
    """The faces of each connected part, if all are closed and none is the inside of another; else all faces.

    Faces are connected across edges of exactly two faces: boards that meet in an edge stay separate.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    of_face = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(edges.T)
    edges, of_face = edges[order], of_face[order]
    _, first, count = np.unique(edges, axis=0, return_index=True, return_counts=True)
    pairs = first[count == 2]
    graph = coo_array((np.ones(len(pairs)), (of_face[pairs], of_face[pairs + 1])), shape=(len(faces), len(faces)))
    number, part_of = connected_components(graph, directed=False)
    if number > MOST_PARTS:
        return [faces]
    parts = [faces[part_of == k] for k in range(number)]
    return parts if all(_closed(part) and _volume(points, part) > 0.0 for part in parts) else [faces]


def _closed(faces: Faces) -> bool:
    """Whether every edge has one triangle on each side, with the same orientation."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward, backward = edges[np.lexsort(edges.T)], edges[:, ::-1][np.lexsort(edges[:, ::-1].T)]
    return bool(np.array_equal(forward, backward)) and not bool((forward[1:] == forward[:-1]).all(axis=1).any())


def _volume(points: Array, faces: Faces, about: Array | None = None) -> float:
    """Signed volume between the triangles and a point, by default any: a closed surface encloses the same from all."""
    a, b, c = (points[faces[:, k]] - (points[0] if about is None else about) for k in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6.0


def _hull(points: Array) -> tuple[Array, Faces, float] | None:
    """Corners, outward triangles and volume of the convex hull; None for points without volume.

    The corners are rounded to single precision: an engine reads them from STL, and all programs use the same.
    """
    from scipy.spatial import ConvexHull, QhullError

    rounded = np.unique(points.astype(np.float32).astype(np.float64), axis=0)
    try:
        found = ConvexHull(rounded)
    except (QhullError, ValueError):
        return None
    corners = rounded[found.vertices]
    triangles = np.searchsorted(found.vertices, found.simplices)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward, ::-1]
    return corners, triangles.astype(np.int64), float(found.volume)


def _three(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _indices(values: list[int]) -> tuple[int, int, int]:
    a, b, c = values
    return a, b, c
