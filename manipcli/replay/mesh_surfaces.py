"""Mesh files as coloured surfaces."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from manipcli.replay.surface import Rgba, Surface, smoothed


class UnreadableMesh(Exception):
    """A mesh file that cannot be drawn, and why."""


@lru_cache(maxsize=256)
def mesh_surfaces(path: Path) -> tuple[Surface, ...]:
    """The surfaces of a mesh file in its own frame, unscaled; each colour of the file is one.

    Raises:
        UnreadableMesh: it is absent, of an unknown kind, damaged or empty.
    """
    import trimesh

    if not path.is_file():
        raise UnreadableMesh(f"there is no file '{path.name}'")
    try:
        scene = trimesh.load_scene(path)
        parts = scene.dump()
    except Exception as error:
        raise UnreadableMesh(f"'{path.name}' cannot be read as a mesh") from error
    found = [smoothed(part.vertices, part.faces, _colour(part)) for part in parts if isinstance(part, trimesh.Trimesh)]
    found = [one for one in found if len(one.faces)]
    if not found or not all(np.isfinite(one.vertices).all() for one in found):
        raise UnreadableMesh(f"'{path.name}' holds no triangle that can be drawn")
    return tuple(found)


def _colour(part: object) -> Rgba | None:
    material = getattr(getattr(part, "visual", None), "material", None)
    main = getattr(material, "main_color", None)
    if main is None:
        return None
    r, g, b, a = (float(value) / 255.0 for value in main)
    return (r, g, b, a)
