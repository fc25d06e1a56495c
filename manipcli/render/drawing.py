"""Drawing of a robot and a scene: named surfaces in named frames, independent of viewers and renderers.

A `Drawing` holds the surfaces; `Placing` computes the poses of its frames, for one state or for many.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.text import listed
from manipcli.description.elements import Inertial, Link
from manipcli.model.robot import RobotModel
from manipcli.render.mesh_surfaces import mesh_surfaces
from manipcli.render.mitred_walls import mitred_walls
from manipcli.render.placing import Poses
from manipcli.render.surface import Surface, box_surface, cylinder_surface, smoothed, sphere_surface
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Rgba, Shape, Sphere, drawn_once

Layer = Literal["visual", "collision", "inertia"]

PLAIN: Rgba = (0.72, 0.74, 0.77, 1.0)
"""Default colour, without a colour in the description and the mesh."""
COLLISION: Rgba = (0.98, 0.60, 0.10, 0.45)
INERTIA: Rgba = (0.20, 0.45, 0.90, 0.45)
THINNEST = 1e-3
"""Smallest edge of an inertia box [m], so that a rod or a plate stays visible."""
WORLD = "world"
FLOOR = "floor"
"""Kind of the floor body; pages and the view draw a grid instead."""
BONE_RADIUS, BONE_SLENDERNESS, SHORTEST_BONE = 0.02, 8.0, 1e-3
"""Bones: largest radius [m], smallest ratio of length to radius, and shortest drawn length [m]."""
LAST_BONE = 0.01
"""Radius of the ball for a link without child joints [m]."""


@dataclass(frozen=True, slots=True)
class Drawable:
    """One surface.

    Attributes:
        name: unique in its drawing, `robot/link_1/visual_0`.
        layer: visual, collision or inertia.
        frame: the frame it is fixed in.
        surface: triangles in that frame.
        rgba: 0 to 1.
    """

    name: str
    layer: Layer
    frame: str
    surface: Surface
    rgba: Rgba


@dataclass(frozen=True, slots=True)
class Mark:
    """A named frame shown as three axes, such as the tool or a frame of the task."""

    name: str
    frame: str
    X_FM: Transform


@dataclass(frozen=True)
class Drawing:
    """Surfaces and frames of a robot and a scene.

    Attributes:
        frames: `world`, then `robot/<link>` for each link, then the bodies by name: the order of all pose arrays.
        drawables: surfaces, each fixed in a frame.
        marks: further frames.
        missing: parts that cannot be drawn, one line each.
    """

    frames: tuple[str, ...]
    drawables: tuple[Drawable, ...]
    marks: tuple[Mark, ...] = ()
    missing: tuple[str, ...] = ()

    def layer(self, layer: Layer) -> tuple[Drawable, ...]:
        """The drawables of one layer."""
        return tuple(drawable for drawable in self.drawables if drawable.layer == layer)


def link_frame(link: str) -> str:
    """The frame name of a link, as in contacts; no body can have this name."""
    return f"robot/{link}"


def frame_names(robot: RobotModel | None, scene: Scene | None) -> tuple[str, ...]:
    """`frames` of the drawing of a robot, a scene, or both."""
    links = () if robot is None else (link_frame(link.name) for link in robot.links)
    bodies = () if scene is None else (body.name for body in scene.bodies)
    return (WORLD, *links, *bodies)


def draw(robot: RobotModel | None, scene: Scene | None = None, *, deviation: float | None = None) -> Drawing:
    """The drawing of a robot, a scene, or both; spheres and cylinders within `deviation` [m] [default: for the eye].

    For the eye, the walls of a cup are drawn with mitred joints. Collision meshes are drawn as their convex hulls, as
    planner and physics use them. A link without drawable visual shapes is drawn with its collision shapes, and a link
    without either with bones.
    """
    missing: list[str] = []
    drawables: list[Drawable] = []
    marks: list[Mark] = []
    if robot is not None:
        bare: list[str] = []
        for link in robot.links:
            shown = tuple(_link(link, missing, deviation))
            drawables += shown
            if (link.visuals or link.collisions) and not any(drawable.layer == "visual" for drawable in shown):
                bare.append(link.name)
        if bare:
            drawables += (
                Drawable(f"{link_frame(name)}/bone_{k}", "visual", link_frame(name), bone, PLAIN)
                for name in bare
                for k, bone in enumerate(bones(robot, name))
            )
            missing.insert(0, f"drawn as bones between joints: {listed(bare)}")
        if robot.tool is not None:
            marks.append(Mark("tool", link_frame(robot.tool.link), robot.tool.X_LT))
    if scene is not None:
        for body in scene.bodies:
            drawables += _body(body, missing, deviation)
        marks += [Mark(frame.name, frame.parent, frame.X_PF) for frame in scene.frames]
    return Drawing(frame_names(robot, scene), tuple(drawables), tuple(marks), tuple(dict.fromkeys(missing)))


def _link(link: Link, missing: list[str], deviation: float | None) -> Iterator[Drawable]:
    frame = link_frame(link.name)
    seen = list(_shapes("visual", frame, link.visuals, None, missing, deviation))
    touched = list(_shapes("collision", frame, link.collisions, COLLISION, missing, deviation))
    # Draw the collision shapes of a link without visual shapes or with missing meshes.
    instead = () if seen else touched
    yield from seen
    yield from (replace(drawable, name=f"{drawable.name}_seen", layer="visual", rgba=PLAIN) for drawable in instead)
    yield from touched
    if link.inertial is not None:
        yield from _inertia(frame, link.inertial)


def bones(robot: RobotModel, link: str) -> tuple[Surface, ...]:
    """Surfaces for a link without shapes, in its frame: a bone to each child joint (at zero), else a ball."""
    ends = [joint.X_PJ.p for joint in robot.joints if joint.parent == link]
    found = tuple(_bone(end) for end in ends if np.linalg.norm(end) > SHORTEST_BONE)
    return found or (sphere_surface(Sphere(LAST_BONE)),)


def _bone(end: Array) -> Surface:
    length = float(np.linalg.norm(end))
    z = end / length
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z], axis=1)
    cylinder = Cylinder(radius=min(BONE_RADIUS, length / BONE_SLENDERNESS), length=length)
    return cylinder_surface(cylinder).moved(Transform.of(xyz=end / 2.0, R=R))


def _body(body: Body, missing: list[str], deviation: float | None) -> Iterator[Drawable]:
    yield from _shapes("visual", body.name, body.geometries, None, missing, deviation)
    yield from _shapes("collision", body.name, body.geometries, COLLISION, missing, deviation)
    if not body.fixed:
        yield from _inertia(body.name, Inertial(body.mass, body.X_OI, body.inertia))


def _shapes(
    layer: Layer,
    frame: str,
    geometries: tuple[Geometry, ...],
    rgba: Rgba | None,
    missing: list[str],
    deviation: float | None,
) -> Iterator[Drawable]:
    shown = geometries if layer == "collision" else drawn_once(geometries)
    walls = mitred_walls(shown) if layer == "visual" and deviation is None else {}
    for k, geometry in enumerate(shown):
        try:
            surfaces = (
                (walls[k],)
                if k in walls
                else shape_surfaces(geometry.shape, hull=layer == "collision", deviation=deviation)
            )
        except UnusableMesh as error:
            missing.append(f"{layer} shape of '{frame}': {error}")
            continue
        for n, part in enumerate(surfaces):
            name = f"{frame}/{layer}_{k}" + (f"_{n}" if len(surfaces) > 1 else "")
            yield Drawable(name, layer, frame, part.moved(geometry.X_LS), rgba or geometry.rgba or part.rgba or PLAIN)


def shape_surfaces(shape: Shape, *, hull: bool = False, deviation: float | None = None) -> tuple[Surface, ...]:
    """The surfaces of a shape in its own frame, scaled; one for each colour of a mesh file.

    Args:
        shape: the shape.
        hull: use the convex hull of a mesh, or its part, instead of its triangles.
        deviation: most by which chords of spheres and cylinders lie within them [m].

    Raises:
        UnusableMesh: the mesh cannot be drawn.
    """
    match shape:
        case Box():
            return (box_surface(shape),)
        case Sphere():
            return (sphere_surface(shape, deviation),)
        case Cylinder():
            return (cylinder_surface(shape, deviation),)
        case Mesh(part=part) if hull and part is not None:
            return (smoothed(np.array(part.points), np.array(part.triangles)).scaled(shape.scale),)
        case Mesh():
            whole = tuple(part.scaled(shape.scale) for part in mesh_surfaces(shape.path))
            return (_hull(whole),) if hull else whole


def _hull(surfaces: tuple[Surface, ...]) -> Surface:
    """The convex hull of all vertices; the surfaces themselves if they span no volume."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.concatenate([part.vertices for part in surfaces])
    try:
        found = ConvexHull(points)
    except QhullError:
        first = np.cumsum([0, *(len(part.vertices) for part in surfaces[:-1])])
        return smoothed(points, np.concatenate([part.faces + k for part, k in zip(surfaces, first, strict=True)]))
    faces = np.array(found.simplices)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    faces[inward] = faces[inward, ::-1]
    return smoothed(points, faces)


def inertia_box(inertial: Inertial) -> tuple[Box, Transform]:
    """The uniform box with the mass and inertia of a body, and its pose X_LB in the frame of the body.

    With principal moments I1, I2, I3 its edges are a_i = sqrt(6 (I_j + I_k - I_i) / m), from I_i = m (a_j^2 + a_k^2)
    / 12; a negative radicand (no body has such moments) gives an edge of length 0.
    """
    moments, axes = np.linalg.eigh(inertial.inertia)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    squares = 6.0 * (float(moments.sum()) - 2.0 * moments) / inertial.mass
    a, b, c = (math.sqrt(max(float(square), 0.0)) for square in squares)
    return Box((a, b, c)), inertial.X_LI @ Transform.of(R=axes)


def _inertia(frame: str, inertial: Inertial) -> Iterator[Drawable]:
    if inertial.mass <= 0.0 or not np.isfinite(inertial.inertia).all():
        return
    box, X = inertia_box(inertial)
    a, b, c = (max(edge, THINNEST) for edge in box.size)
    yield Drawable(f"{frame}/inertia", "inertia", frame, box_surface(Box((a, b, c))).moved(X), INERTIA)


def floors_of(scene: Scene | None) -> frozenset[str]:
    """Names of the floor bodies."""
    return frozenset(body.name for body in scene.bodies if body.kind == FLOOR) if scene is not None else frozenset()


def ground_height(drawing: Drawing, poses: Poses, floors: frozenset[str]) -> float:
    """Height of the ground grid [m]: z = 0, or the lowest point if it is lower.

    Args:
        drawing: the drawing.
        poses: poses of one state.
        floors: frames that are not drawn.
    """
    index = {name: k for k, name in enumerate(drawing.frames)}
    lowest = (
        float(poses.X_WF(index[drawable.frame]).apply(drawable.surface.vertices)[:, 2].min())
        for drawable in drawing.layer("visual")
        if drawable.frame not in floors and len(drawable.surface.vertices)
    )
    return min(0.0, min(lowest, default=0.0))
