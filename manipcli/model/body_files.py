"""Bodies that come from files: a mesh, taken as its convex hull."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Transform, frozen
from manipcli.model.body_shapes import BodyShape, Rgba
from manipcli.model.coal_shape import coal_shape
from manipcli.model.robot import Geometry, Inertial, Mesh
from manipcli.spec.task import MeshSpec

MESH_SUFFIXES = (".stl", ".obj", ".dae")


def mesh(spec: MeshSpec, path: Path, rgba: Rgba) -> BodyShape:
    """A mesh in its own frame; hull, bounding box and mass properties (at uniform density) of its convex hull.

    Its inertial states 1 kg per m3, so that only its mass has to be scaled; a mesh has no mass of its own.

    Raises:
        ValueError: the file is absent, of another kind, unreadable, or encloses no volume.
    """
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise ValueError(f"'{spec.file}' is no mesh that can be read; it must end in {', '.join(MESH_SUFFIXES)}")
    if not path.is_file():
        raise ValueError(f"there is no file '{spec.file}'")
    shape = Mesh(uri=spec.file, path=path, scale=(spec.scale, spec.scale, spec.scale))
    try:
        hull = coal_shape(shape)
    except (ValueError, RuntimeError) as error:
        raise ValueError(f"'{spec.file}' cannot be used as a mesh: it holds no solid") from error
    points = np.array(hull.points())
    volume = float(hull.computeVolume())
    if not (math.isfinite(volume) and volume > 0.0 and np.all(np.isfinite(points))):
        raise ValueError(f"'{spec.file}' cannot be used as a mesh: its hull encloses no volume")
    low, high = points.min(axis=0), points.max(axis=0)
    return BodyShape(
        geometries=(Geometry(X_LS=Transform.identity(), shape=shape, rgba=rgba),),
        interior=None,
        size=frozen(high - low),
        centre=frozen((high + low) / 2.0),
        inertial=principal(volume, hull.computeCOM(), hull.computeMomentofInertiaRelatedToCOM()),
    )


def principal(mass: float, centre: npt.ArrayLike, inertia: npt.ArrayLike) -> Inertial:
    """The inertial with its frame turned into the principal axes, so that `inertia` (3, 3) becomes diagonal.

    Args:
        mass: [kg].
        centre: (3,) [m] centre of mass in the body's frame.
        inertia: (3, 3) [kg m2] about `centre`, along the axes of the body's frame.
    """
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=np.float64))
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return Inertial(mass=mass, X_LI=Transform.of(xyz=centre, R=axes), inertia=frozen(np.diag(moments)))
