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

from manipcli.core.activity import announce
from manipcli.core.cache import cache_key, read_cached, write_cached
from manipcli.core.geometry import Array
from manipcli.shapes.coacd_process import SETTINGS
from manipcli.shapes.mesh import TriangleMesh, read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import ConvexPart
from manipcli.shapes.surface import Faces, closed, hull, volume, welded

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


def concave(path: Path, share: float = SOLID) -> bool:
    """Whether a mesh fills less than this share of its convex hull.

    Small holes of a scanned surface count for little: what is behind a hole, seen from the middle, counts as empty. An
    open box fills 5/6, half a sphere without a lid 13/16. False for a file that cannot be used as a mesh, which has no
    parts either.
    """
    try:
        return _filled(read_mesh(path)) < share
    except UnusableMesh:
        return False


@functools.lru_cache(maxsize=64)
def _filled(mesh: TriangleMesh) -> float:
    """Share of the convex hull that is filled; 1 for a flat mesh. Cached, like `_parts`."""
    points, faces = welded(mesh)
    whole = hull(points)
    return 1.0 if whole is None else abs(volume(points, faces, whole[0].mean(axis=0))) / whole[2]


def convex_parts(path: Path) -> tuple[ConvexPart, ...]:
    """The convex parts of a mesh, in the unscaled frame of its file.

    Raises:
        UnusableMesh: the file cannot be used, has too many triangles, or cannot be decomposed; CoACD is not installed.
    """
    return _parts(read_mesh(path), path.name)


@functools.lru_cache(maxsize=64)
def _parts(mesh: TriangleMesh, name: str) -> tuple[ConvexPart, ...]:
    """Cached: the reader returns the same mesh object while the file does not change."""
    points, faces = welded(mesh)
    whole = hull(points)
    if whole is None:
        raise UnusableMesh("is flat")
    separate = _separate(points, faces)
    hulls: list[Array] = []
    for part in separate:
        corners = points[np.unique(part)]
        made = hull(corners)
        if made is not None and closed(part) and volume(points, part) >= CONVEX * made[2]:
            hulls.append(corners)
        elif made is not None:
            hulls += _decomposed(points, part, name)
    found = [part for part in map(hull, hulls) if part is not None and part[2] > LEAST_SHARE * whole[2]]
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
    return parts if all(closed(part) and volume(points, part) > 0.0 for part in parts) else [faces]


def _three(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _indices(values: list[int]) -> tuple[int, int, int]:
    a, b, c = values
    return a, b, c
