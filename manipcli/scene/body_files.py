"""Bodies from files: a mesh, or the only link of a URDF; meshes count as their convex hulls or convex parts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial
from manipcli.description.expanded import read_description
from manipcli.description.lint.rigid import box_about
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import Parts, read_parts
from manipcli.scene.body_shapes import COLORS, BodyShape
from manipcli.scene.hollow import hollow_of
from manipcli.shapes.convex_parts import concave, convex_parts
from manipcli.shapes.mesh import SUFFIXES
from manipcli.shapes.primitives import Geometry, Mesh, Rgba
from manipcli.shapes.proximity import coal_shape
from manipcli.spec.scene import MeshCollision, MeshSpec, UrdfSpec

MOST_LINKS: Final = 100
HELD: Final = "use revolute, continuous, prismatic and fixed joints"
"""Hint for a joint with several degrees of freedom."""


def mesh(spec: MeshSpec, packages: Packages, rgba: Rgba) -> BodyShape:
    """A mesh in its own frame, with the bounding box and mass properties of its convex hull or of its convex parts.

    The inertial is for a density of 1 kg/m3 and is scaled to the mass of the body.

    Raises:
        NotFound: the file does not exist.
        ValueError: the file has another format, is unreadable, or encloses no volume.
        UnusableMesh: its convex parts cannot be made.
    """
    path = packages.resolve(spec.file, anywhere=True)
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"'{spec.file}' is not a supported mesh file; expected {', '.join(SUFFIXES)}")
    # A path is relative to the task file, which a log does not contain.
    uri = spec.file if spec.file.startswith("package:") else packages.portable(path)
    shape = Mesh(uri=uri, path=path, scale=(spec.scale, spec.scale, spec.scale))
    geometries = in_parts((Geometry(X_LS=Transform.identity(), shape=shape, rgba=rgba),), spec.collision)
    try:
        hulls = [coal_shape(each.shape) for each in geometries]
    except (ValueError, RuntimeError) as error:
        raise ValueError(f"'{spec.file}' cannot be used as a mesh: it has no convex hull") from error
    points = np.concatenate([np.array(hull.points()) for hull in hulls])
    volumes = np.array([hull.computeVolume() for hull in hulls])
    volume = float(volumes.sum())
    if not (math.isfinite(volume) and volume > 0.0 and np.all(np.isfinite(points))):
        raise ValueError(f"'{spec.file}' cannot be used as a mesh: its convex hull has no volume")
    low, high = points.min(axis=0), points.max(axis=0)
    centres = np.array([hull.computeCOM() for hull in hulls])
    centre = volumes @ centres / volume
    inertia = np.zeros((3, 3))  # about the common centre: the parallel axis theorem
    for hull, mass, d in zip(hulls, volumes, centres - centre, strict=True):
        inertia += hull.computeMomentofInertiaRelatedToCOM() + mass * (d @ d * np.eye(3) - np.outer(d, d))
    return BodyShape(
        geometries=geometries,
        interior=hollow_of(geometries),
        size=frozen(high - low),
        centre=frozen((high + low) / 2.0),
        inertial=principal(volume, centre, inertia),
    )


def in_parts(geometries: Sequence[Geometry], collision: MeshCollision | None) -> tuple[Geometry, ...]:
    """The geometries with convex parts in place of each mesh that `collision` applies to; None: of a concave mesh.

    Raises:
        UnusableMesh: convex parts of a mesh cannot be made.
    """
    made: list[Geometry] = []
    for each in geometries:
        mesh = each.shape
        if isinstance(mesh, Mesh) and collision != "hull" and (collision == "parts" or concave(mesh.path)):
            made += [replace(each, shape=replace(mesh, part=part)) for part in convex_parts(mesh.path)]
        else:
            made.append(each)
    return tuple(made)


def read_urdf(spec: UrdfSpec, packages: Packages) -> Parts:
    """Links and joints of the URDF or xacro file of a body.

    Raises:
        NotFound: the file does not exist.
        InvalidInput: the file has errors, each with its place.
        ValueError: it has more links than an engine can take.
    """
    path = packages.resolve(spec.file, anywhere=True)
    parts = read_parts(read_description(path, packages=packages.below(path), arguments=spec.args))
    if parts.errors:
        raise InvalidInput(parts.errors)
    held = [
        replace(each, severity="error", message=each.message.partition(":")[0], hint=HELD)
        for each in parts.findings
        if each.code == "URDF065"
    ]
    if held:
        raise InvalidInput(held)
    if len(parts.links) > MOST_LINKS:
        raise ValueError(f"'{spec.file}' has {len(parts.links)} links, expected at most {MOST_LINKS}")
    return parts


def urdf(spec: UrdfSpec, parts: Parts, rgba: Rgba | None) -> BodyShape:
    """The only link of a URDF, in the link's frame: its collision shapes and its inertia.

    Args:
        spec: names the file.
        parts: what is in it.
        rgba: overrides the file's colours.

    Raises:
        UnusableMesh: convex parts of a mesh cannot be made.
        ValueError: it has no collision shape, or (for a link with mass) no moments of inertia.
    """
    (link,) = parts.links
    if not link.collisions:
        raise ValueError(f"link '{link.name}' of '{spec.file}' has no collision shape")
    seen = next((shape.rgba for shape in link.visuals if shape.rgba is not None), COLORS["urdf"])
    shapes = tuple(replace(shape, rgba=rgba or shape.rgba or seen) for shape in link.collisions)
    shapes = in_parts(shapes, spec.collision)
    box = box_about(shapes)
    assert box is not None  # every mesh has been read
    low, high = box
    inertial = None
    if link.inertial is not None and link.inertial.mass > 0.0:
        X, inertia = link.inertial.X_LI, link.inertial.inertia
        inertial = principal(link.inertial.mass, X.p, X.R @ inertia @ X.R.T)
    return BodyShape(
        geometries=shapes,
        interior=hollow_of(shapes),
        size=frozen(high - low),
        centre=frozen((high + low) / 2.0),
        inertial=inertial,
    )


def principal(mass: float, centre: npt.ArrayLike, inertia: npt.ArrayLike) -> Inertial:
    """The inertial in the frame of the principal axes, where `inertia` (3, 3) is diagonal.

    Args:
        mass: [kg].
        centre: (3,) [m] centre of mass in the body's frame.
        inertia: (3, 3) [kg m2] about `centre`, along the axes of the body's frame.
    """
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=np.float64))
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return Inertial(mass=mass, X_LI=Transform.of(xyz=centre, R=axes), inertia=frozen(np.diag(moments)))
