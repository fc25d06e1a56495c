"""Geometry of the bodies that a task file can define (`cup: {...}`): shapes, interior, bounding box, colour.

All in the body's frame O: at the centre of a box or sphere, at the centre of the bottom of other bodies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial
from manipcli.scene.mass_properties import union
from manipcli.scene.scene import Interior
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Rgba, Shape, Sphere
from manipcli.spec.scene import BodySpec, BoxSpec, CupSpec, CylinderSpec, HandleSpec, SphereSpec, TraySpec

COLORS: dict[str, Rgba] = {
    "floor": (0.80, 0.81, 0.82, 1.0),
    "box": (0.83, 0.55, 0.25, 1.0),
    "desk": (0.62, 0.46, 0.32, 1.0),
    "sphere": (0.82, 0.20, 0.17, 1.0),
    "cylinder": (0.36, 0.52, 0.72, 1.0),
    "cup": (0.68, 0.83, 0.69, 1.0),
    "tray": (0.44, 0.52, 0.61, 1.0),
    "mesh": (0.70, 0.66, 0.58, 1.0),
    "urdf": (0.70, 0.66, 0.58, 1.0),
    "moved": (0.55, 0.63, 0.70, 1.0),
    "part": (0.30, 0.32, 0.35, 1.0),
}
"""By kind of body; `desk` is a fixed box, `moved` a link that a joint moves, `part` what is fixed to one."""
FLOOR_SIZE = (10.0, 10.0, 0.1)


@dataclass(frozen=True, slots=True)
class BodyShape:
    """Geometry of a body before it has a pose.

    Attributes:
        geometries: shapes in O.
        interior: its hollow, or None.
        size, centre: (3,) [m] bounding box in O; of a cup without its handle.
        radius: [m] of the outline seen from above if it is a circle about O's z axis, else None.
        flat_top: whether other bodies can rest on its upper side.
        inertial: mass properties from a file; None: those of the union of the geometries at uniform density.
    """

    geometries: tuple[Geometry, ...]
    interior: Interior | None
    size: Array
    centre: Array
    radius: float | None = None
    flat_top: bool = False
    inertial: Inertial | None = None

    def covers(self, x: float, y: float) -> bool:
        """Whether the outline seen from above has (x, y) [m], from its middle."""
        if self.radius is not None:
            return bool(np.hypot(x, y) <= self.radius)
        return bool(abs(x) <= self.size[0] / 2.0 and abs(y) <= self.size[1] / 2.0)


def inertial_of(spec: BodySpec, shape: BodyShape) -> Inertial:
    """Mass properties in O: those of a file scaled to the written mass, else those of the union of the shapes."""
    if spec.fixed:
        return Inertial(mass=0.0, X_LI=Transform.identity(), inertia=frozen(np.zeros((3, 3))))
    if shape.inertial is None:
        return union(shape.geometries, spec.mass or 1.0)  # a missing mass is already reported
    mass = spec.mass or shape.inertial.mass
    inertia = frozen(shape.inertial.inertia * (mass / shape.inertial.mass))
    return Inertial(mass=mass, X_LI=shape.inertial.X_LI, inertia=inertia)


def primitive(spec: BodySpec, rgba: Rgba) -> BodyShape | None:
    """The shape of a body that is in the task itself; None: it is in a file.

    Raises:
        ValueError: its numbers contradict each other.
    """
    if spec.box is not None:
        return box(spec.box, rgba)
    if spec.sphere is not None:
        return sphere(spec.sphere, rgba)
    if spec.cylinder is not None:
        return cylinder(spec.cylinder, rgba)
    if spec.cup is not None:
        return cup(spec.cup, rgba)
    return None if spec.tray is None else tray(spec.tray, rgba)


def floor() -> BodyShape:
    # A thick box instead of PyBullet's plane: the same body for contact, collision checks and drawing.
    return BodyShape(
        geometries=(Geometry(X_LS=Transform.identity(), shape=Box(FLOOR_SIZE), rgba=COLORS["floor"]),),
        interior=None,
        size=frozen(FLOOR_SIZE),
        centre=frozen(np.zeros(3)),
        flat_top=True,
    )


def box(spec: BoxSpec, rgba: Rgba) -> BodyShape:
    return BodyShape(
        geometries=(_placed(Box(spec.size), (0.0, 0.0, 0.0), rgba),),
        interior=None,
        size=frozen(spec.size),
        centre=frozen(np.zeros(3)),
        flat_top=True,
    )


def sphere(spec: SphereSpec, rgba: Rgba) -> BodyShape:
    return BodyShape(
        geometries=(_placed(Sphere(spec.radius), (0.0, 0.0, 0.0), rgba),),
        interior=None,
        size=frozen([2.0 * spec.radius] * 3),
        centre=frozen(np.zeros(3)),
        radius=spec.radius,
    )


def cylinder(spec: CylinderSpec, rgba: Rgba) -> BodyShape:
    """A cylinder whose bottom is at the origin."""
    return BodyShape(
        geometries=(_placed(Cylinder(spec.radius, spec.height), (0.0, 0.0, spec.height / 2.0), rgba),),
        interior=None,
        size=frozen([2.0 * spec.radius, 2.0 * spec.radius, spec.height]),
        centre=frozen([0.0, 0.0, spec.height / 2.0]),
        radius=spec.radius,
        flat_top=True,
    )


def cup(spec: CupSpec, rgba: Rgba) -> BodyShape:
    """A floor disc and `segments` wall boxes on it.

    The outer faces of the walls touch the circle of `radius`, their inner faces that of radius - wall. Each box is
    2 R tan(pi / n) wide with R at the middle of the wall: the overlaps inside equal the gaps outside, so the volume of
    the walls is that of the n-sided ring.

    Raises:
        ValueError: its numbers contradict each other.
    """
    if spec.wall >= min(spec.radius, spec.height):
        raise ValueError(f"wall of {spec.wall:g} m is too thick: the cup has no interior")
    middle, inner, n = spec.radius - spec.wall / 2.0, spec.radius - spec.wall, spec.segments
    depth = spec.height - spec.wall
    wall = Box((spec.wall, 2.0 * middle * math.tan(math.pi / n), depth))
    walls = []
    for k in range(n):
        angle = 2.0 * math.pi * k / n
        p = (middle * math.cos(angle), middle * math.sin(angle), spec.wall + depth / 2.0)
        walls.append(Geometry(X_LS=Transform.of(xyz=p, rpy=(0.0, 0.0, angle)), shape=wall, rgba=rgba))
    if spec.handle is not None:
        walls += _handle(spec.handle, middle, spec, rgba)
    outline = math.hypot(spec.radius, wall.size[1] / 2.0)
    return BodyShape(
        geometries=(_placed(Cylinder(spec.radius, spec.wall), (0.0, 0.0, spec.wall / 2.0), rgba), *walls),
        interior=Interior(
            X_OS=Transform.of(xyz=(0.0, 0.0, spec.wall + depth / 2.0)), shape=Cylinder(radius=inner, length=depth)
        ),
        size=frozen([2.0 * outline, 2.0 * outline, spec.height]),
        centre=frozen([0.0, 0.0, spec.height / 2.0]),
        radius=outline if spec.handle is None else None,
    )


def _handle(spec: HandleSpec, start: float, cup: CupSpec, rgba: Rgba) -> list[Geometry]:
    """Two level bars that begin in the wall, at `start` [m] from the axis, and an upright one between their ends.

    Raises:
        ValueError: it is beyond the cup, or has no room for fingers.
    """
    t, end, middle = spec.thickness, cup.radius + spec.reach, cup.height / 2.0 if spec.middle is None else spec.middle
    if abs(middle - cup.height / 2.0) > (cup.height - spec.height) / 2.0 + 1e-9:
        low, high = middle - spec.height / 2.0, middle + spec.height / 2.0
        raise ValueError(f"handle from {low:g} to {high:g} m is beyond the cup of {cup.height:g} m")
    if t >= min(spec.reach, spec.height / 2.0):
        raise ValueError(f"thickness of {t:g} m leaves no room in the handle")
    level, upright = Box((end - start, t, t)), Box((t, t, spec.height - 2.0 * t))
    high = (spec.height - t) / 2.0
    return [
        _placed(level, ((start + end) / 2.0, 0.0, middle + high), rgba),
        _placed(level, ((start + end) / 2.0, 0.0, middle - high), rgba),
        _placed(upright, (end - t / 2.0, 0.0, middle), rgba),
    ]


def tray(spec: TraySpec, rgba: Rgba) -> BodyShape:
    """A floor and four walls on it; the walls along y are between those along x.

    Raises:
        ValueError: its walls leave no interior.
    """
    (x, y, z), w = spec.size, spec.wall
    if w >= min(x / 2.0, y / 2.0, z):
        raise ValueError(f"wall of {w:g} m is too thick: the tray has no interior")
    depth = z - w
    middle = w + depth / 2.0
    along_x, along_y = Box((x, w, depth)), Box((w, y - 2.0 * w, depth))
    return BodyShape(
        geometries=(
            _placed(Box((x, y, w)), (0.0, 0.0, w / 2.0), rgba),
            _placed(along_x, (0.0, (y - w) / 2.0, middle), rgba),
            _placed(along_x, (0.0, (w - y) / 2.0, middle), rgba),
            _placed(along_y, ((x - w) / 2.0, 0.0, middle), rgba),
            _placed(along_y, ((w - x) / 2.0, 0.0, middle), rgba),
        ),
        interior=Interior(X_OS=Transform.of(xyz=(0.0, 0.0, middle)), shape=Box((x - 2.0 * w, y - 2.0 * w, depth))),
        size=frozen(spec.size),
        centre=frozen([0.0, 0.0, z / 2.0]),
    )


def _placed(shape: Shape, p: tuple[float, float, float], rgba: Rgba) -> Geometry:
    return Geometry(X_LS=Transform.of(xyz=p), shape=shape, rgba=rgba)


def too_big(shape: BodyShape, yaw: float, interior: Interior, x: float = 0.0, y: float = 0.0) -> float:
    """Excess [m] of the outline of the shape at (x, y) [m] and `yaw` [rad] over the interior; <= 0: it fits."""
    half: Array = shape.size[:2] / 2.0
    if isinstance(interior.shape, Cylinder):
        outline = shape.radius if shape.radius is not None else float(np.hypot(*half))
        return outline + float(np.hypot(x, y)) - interior.shape.radius
    if shape.radius is None:
        c, s = abs(np.cos(yaw)), abs(np.sin(yaw))
        half = np.array([c * half[0] + s * half[1], s * half[0] + c * half[1]])
    return float(np.max(half + np.abs([x, y]) - np.array(interior.shape.size[:2]) / 2.0))
