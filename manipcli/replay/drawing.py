"""What is drawn of a robot and a scene: named surfaces in named frames. Knows no viewer and no renderer.

A `Drawing` says what there is, once; `Placing` says where its frames are, for one state or for thousands.
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
from manipcli.replay.mesh_surfaces import mesh_surfaces
from manipcli.replay.placing import Poses
from manipcli.replay.surface import Surface, box_surface, cylinder_surface, smoothed, sphere_surface
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Rgba, Shape, Sphere

Layer = Literal["visual", "collision", "inertia"]

PLAIN: Rgba = (0.72, 0.74, 0.77, 1.0)
"""Where neither the description nor the mesh says a colour."""
COLLISION: Rgba = (0.98, 0.60, 0.10, 0.45)
INERTIA: Rgba = (0.20, 0.45, 0.90, 0.45)
THINNEST = 1e-3
"""Least length of an edge of an inertia box [m]: a rod or a plate would not be seen."""
WORLD = "world"
FLOOR = "floor"
"""The kind of body that everything is on; pages and the view draw a grid in its place."""
BONE_RADIUS, BONE_SLENDERNESS, SHORTEST_BONE = 0.02, 8.0, 1e-3
"""Of a bone: largest radius [m], smallest length over radius, and the shortest that is drawn [m]."""
LAST_BONE = 0.01
"""Radius [m] of the ball in place of a link without joints below it."""


@dataclass(frozen=True, slots=True)
class Drawable:
    """One surface.

    Attributes:
        name: unique in its drawing, `robot/link_1/visual_0`.
        layer: what it shows.
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
    """A named frame that is shown as three axes: the tool, a frame of the task."""

    name: str
    frame: str
    X_FM: Transform


@dataclass(frozen=True)
class Drawing:
    """Everything that can be drawn.

    Attributes:
        frames: `world`, then `robot/<link>` for each link, then the bodies by name: the order of all pose arrays.
        drawables: each fixed in one of them.
        marks: further frames.
        missing: what could not be drawn, one line each.
    """

    frames: tuple[str, ...]
    drawables: tuple[Drawable, ...]
    marks: tuple[Mark, ...] = ()
    missing: tuple[str, ...] = ()

    def layer(self, layer: Layer) -> tuple[Drawable, ...]:
        """The drawables of one layer."""
        return tuple(drawable for drawable in self.drawables if drawable.layer == layer)


def link_frame(link: str) -> str:
    """The name of a link's frame: as in contacts, so that no body can have it."""
    return f"robot/{link}"


def draw(robot: RobotModel | None, scene: Scene | None = None) -> Drawing:
    """The drawing of a robot, a scene, or both.

    Collision meshes are drawn as their convex hulls, which is what planner and physics take them for. The collision
    shapes of a link stand in for its visual ones where it has none that can be drawn, and bones where it has neither.
    """
    missing: list[str] = []
    frames: list[str] = [WORLD]
    drawables: list[Drawable] = []
    marks: list[Mark] = []
    if robot is not None:
        bare: list[str] = []
        for link in robot.links:
            frames.append(link_frame(link.name))
            shown = tuple(_link(link, missing))
            drawables += shown
            if (link.visuals or link.collisions) and not any(one.layer == "visual" for one in shown):
                bare.append(link.name)
        if bare:
            drawables += (
                Drawable(f"{link_frame(name)}/bone_{k}", "visual", link_frame(name), bone, PLAIN)
                for name in bare
                for k, bone in enumerate(bones(robot, name))
            )
            missing.insert(0, f"bones between joints stand in for {listed(bare)}")
        if robot.tool is not None:
            marks.append(Mark("tool", link_frame(robot.tool.link), robot.tool.X_LT))
    if scene is not None:
        for body in scene.bodies:
            frames.append(body.name)
            drawables += _body(body, missing)
        marks += [Mark(frame.name, frame.parent, frame.X_PF) for frame in scene.frames]
    return Drawing(tuple(frames), tuple(drawables), tuple(marks), tuple(dict.fromkeys(missing)))


def _link(link: Link, missing: list[str]) -> Iterator[Drawable]:
    frame = link_frame(link.name)
    seen = list(_shapes("visual", frame, link.visuals, None, missing))
    touched = list(_shapes("collision", frame, link.collisions, COLLISION, missing))
    # A link that has nothing to show, or whose meshes are missing, is better seen by what it touches with than not.
    instead = () if seen else touched
    yield from seen
    yield from (replace(one, name=f"{one.name}_seen", layer="visual", rgba=PLAIN) for one in instead)
    yield from touched
    if link.inertial is not None:
        yield from _inertia(frame, link.inertial)


def bones(robot: RobotModel, link: str) -> tuple[Surface, ...]:
    """In place of a link without shapes, in its frame: a bone to each joint below it (at zero), or else a ball."""
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


def _body(body: Body, missing: list[str]) -> Iterator[Drawable]:
    yield from _shapes("visual", body.name, body.geometries, None, missing)
    yield from _shapes("collision", body.name, body.geometries, COLLISION, missing)
    if not body.fixed:
        yield from _inertia(body.name, Inertial(body.mass, body.X_OI, body.inertia))


def _shapes(
    layer: Layer, frame: str, geometries: tuple[Geometry, ...], rgba: Rgba | None, missing: list[str]
) -> Iterator[Drawable]:
    for k, geometry in enumerate(geometries):
        try:
            surfaces = shape_surfaces(geometry.shape, hull=layer == "collision")
        except UnusableMesh as error:
            missing.append(f"{layer} shape of '{frame}': {error}")
            continue
        for n, one in enumerate(surfaces):
            name = f"{frame}/{layer}_{k}" + (f"_{n}" if len(surfaces) > 1 else "")
            yield Drawable(name, layer, frame, one.moved(geometry.X_LS), rgba or geometry.rgba or one.rgba or PLAIN)


def shape_surfaces(shape: Shape, *, hull: bool = False) -> tuple[Surface, ...]:
    """The surfaces of a shape in its own frame, scaled; several where a mesh file has several colours.

    Args:
        shape: the shape.
        hull: the convex hull of a mesh instead of its triangles.

    Raises:
        UnusableMesh: a mesh cannot be drawn.
    """
    match shape:
        case Box():
            return (box_surface(shape),)
        case Sphere():
            return (sphere_surface(shape),)
        case Cylinder():
            return (cylinder_surface(shape),)
        case Mesh():
            whole = tuple(one.scaled(shape.scale) for one in mesh_surfaces(shape.path))
            return (_hull(whole),) if hull else whole


def _hull(surfaces: tuple[Surface, ...]) -> Surface:
    """The convex hull of all vertices; where they span no volume, the surfaces themselves."""
    from scipy.spatial import ConvexHull, QhullError

    points = np.concatenate([one.vertices for one in surfaces])
    try:
        found = ConvexHull(points)
    except QhullError:
        first = np.cumsum([0, *(len(one.vertices) for one in surfaces[:-1])])
        return smoothed(points, np.concatenate([one.faces + k for one, k in zip(surfaces, first, strict=True)]))
    faces = np.array(found.simplices)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    faces[inward] = faces[inward, ::-1]
    return smoothed(points, faces)


def inertia_box(inertial: Inertial) -> tuple[Box, Transform]:
    """The uniform box with the mass and inertia of a body, and X_LB, where it stands in the body's frame.

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
    """The names of the floors."""
    return frozenset(body.name for body in scene.bodies if body.kind == FLOOR) if scene is not None else frozenset()


def ground_height(drawing: Drawing, poses: Poses, floors: frozenset[str]) -> float:
    """[m] of the grid: z = 0, or under what stands lower.

    Args:
        drawing: what is shown.
        poses: one instant.
        floors: frames that are not drawn.
    """
    index = {name: k for k, name in enumerate(drawing.frames)}
    lowest = (
        float(poses.X_WF(index[one.frame]).apply(one.surface.vertices)[:, 2].min())
        for one in drawing.layer("visual")
        if one.frame not in floors and len(one.surface.vertices)
    )
    return min(0.0, min(lowest, default=0.0))
