"""Scene as JSON, which makes a log independent of the files that the scene was built from."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field, TypeAdapter, model_validator

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import Body, Frame, Interior, Scene
from manipcli.scene.walls import Walls
from manipcli.shapes.primitives import Box, ConvexPart, Cylinder, Geometry, Mesh, Shape, Sphere
from manipcli.spec.base import Model

Numbers3 = tuple[float, float, float]
Numbers4 = tuple[float, float, float, float]
Matrix = tuple[Numbers3, Numbers3, Numbers3]


class _Pose(Model):
    xyz: Numbers3
    R: Matrix


class _Box(Model):
    type: Literal["box"]
    size: Numbers3


class _Sphere(Model):
    type: Literal["sphere"]
    radius: float


class _Cylinder(Model):
    type: Literal["cylinder"]
    radius: float
    length: float


class _Mesh(Model):
    type: Literal["mesh"]
    uri: str
    scale: Numbers3


class _MeshPart(Model):
    type: Literal["mesh_part"]
    uri: str
    scale: Numbers3
    index: Annotated[int, Field(ge=0)]
    points: tuple[Numbers3, ...]
    triangles: tuple[tuple[int, int, int], ...]

    @model_validator(mode="after")
    def _connected(self) -> _MeshPart:
        if any(not 0 <= k < len(self.points) for triangle in self.triangles for k in triangle):
            raise ValueError("a triangle has no such point")
        return self


_Shape = Annotated[_Box | _Sphere | _Cylinder | _Mesh | _MeshPart, Field(discriminator="type")]


class _Geometry(Model):
    pose: _Pose
    shape: _Shape
    rgba: Numbers4 | None


class _Walls(Model):
    levels: tuple[float, ...]
    radii: tuple[tuple[float, ...], ...]


class _Interior(Model):
    pose: _Pose
    shape: Annotated[_Box | _Cylinder, Field(discriminator="type")]
    walls: _Walls | None = None


class _Body(Model):
    name: str
    kind: str
    pose: _Pose
    geometries: tuple[_Geometry, ...]
    mass: float
    inertial_pose: _Pose
    inertia: Matrix
    friction: float
    rolling_friction: float
    spinning_friction: float
    restitution: float
    fixed: bool
    interior: _Interior | None
    size: Numbers3
    centre: Numbers3


class _Frame(Model):
    name: str
    parent: str
    pose: _Pose
    size: Numbers3 | None = None


class _Joint(Model):
    name: str
    type: Literal["revolute", "continuous", "prismatic"]
    parent: str
    child: str
    pose: _Pose
    axis: Numbers3
    lower: float | None = None
    upper: float | None = None
    start: float
    damping: float
    friction: float
    stiffness: float
    rest: float
    closed: float


class _Scene(Model):
    bodies: tuple[_Body, ...]
    frames: tuple[_Frame, ...]
    gravity: Numbers3
    joints: tuple[_Joint, ...] = ()


def scene_to_json(scene: Scene) -> bytes:
    """The scene as JSON: deterministic bytes, exact numbers; meshes by their URI, their convex parts whole."""
    bodies = tuple(
        _Body(
            name=body.name,
            kind=body.kind,
            pose=_pose(body.X_WO),
            geometries=tuple(
                _Geometry(pose=_pose(shape.X_LS), shape=_shape(shape.shape), rgba=shape.rgba)
                for shape in body.geometries
            ),
            mass=body.mass,
            inertial_pose=_pose(body.X_OI),
            inertia=_matrix(body.inertia),
            friction=body.friction,
            rolling_friction=body.rolling_friction,
            spinning_friction=body.spinning_friction,
            restitution=body.restitution,
            fixed=body.fixed,
            interior=_hollow(body.interior),
            size=_three(body.size),
            centre=_three(body.centre),
        )
        for body in scene.bodies
    )
    frames = tuple(
        _Frame(
            name=frame.name,
            parent=frame.parent,
            pose=_pose(frame.X_PF),
            size=None if frame.size is None else _three(frame.size),
        )
        for frame in scene.frames
    )
    joints = tuple(_joint(joint) for joint in scene.joints)
    made = _Scene(bodies=bodies, frames=frames, gravity=_three(scene.gravity), joints=joints)
    return (json.dumps(made.model_dump(mode="json", exclude_defaults=True), indent=1) + "\n").encode()


def scene_from_json(text: bytes) -> Scene:
    """The scene that `scene_to_json` wrote. No file is read: the path of a mesh is its URI.

    Raises:
        ValueError: the text is not a valid scene.
    """
    made = TypeAdapter(_Scene).validate_json(text)
    return Scene(
        bodies=tuple(
            Body(
                name=body.name,
                kind=body.kind,
                geometries=tuple(
                    Geometry(X_LS=_transform(shape.pose), shape=_read_shape(shape.shape), rgba=shape.rgba)
                    for shape in body.geometries
                ),
                mass=body.mass,
                X_OI=_transform(body.inertial_pose),
                inertia=frozen(body.inertia),
                friction=body.friction,
                rolling_friction=body.rolling_friction,
                spinning_friction=body.spinning_friction,
                restitution=body.restitution,
                fixed=body.fixed,
                X_WO=_transform(body.pose),
                interior=_read_hollow(body.interior),
                size=frozen(body.size),
                centre=frozen(body.centre),
            )
            for body in made.bodies
        ),
        frames=tuple(
            Frame(
                name=frame.name,
                parent=frame.parent,
                X_PF=_transform(frame.pose),
                size=None if frame.size is None else frozen(frame.size),
            )
            for frame in made.frames
        ),
        gravity=frozen(made.gravity),
        joints=tuple(_read_joint(joint) for joint in made.joints),
    )


def _joint(joint: SceneJoint) -> _Joint:
    values = {word: getattr(joint, word) for word in _PLAIN}
    lower, upper = (limit if math.isfinite(limit) else None for limit in (joint.lower, joint.upper))
    return _Joint(pose=_pose(joint.X_PJ), axis=_three(joint.axis), lower=lower, upper=upper, **values)


def _read_joint(joint: _Joint) -> SceneJoint:
    values = {word: getattr(joint, word) for word in _PLAIN}
    lower = -math.inf if joint.lower is None else joint.lower
    upper = math.inf if joint.upper is None else joint.upper
    return SceneJoint(X_PJ=_transform(joint.pose), axis=frozen(joint.axis), lower=lower, upper=upper, **values)


_PLAIN: Final = (
    "name", "type", "parent", "child", "start", "damping", "friction", "stiffness", "rest", "closed",
)  # fmt: skip
"""Values of a joint that are written as they are."""


def _pose(X: Transform) -> _Pose:
    return _Pose(xyz=_three(X.p), R=_matrix(X.R))


def _transform(pose: _Pose) -> Transform:
    return Transform(R=frozen(pose.R), p=frozen(pose.xyz))


def _three(values: Array) -> Numbers3:
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return (x, y, z)


def _matrix(values: Array) -> Matrix:
    return (_three(values[0]), _three(values[1]), _three(values[2]))


def _shape(shape: Shape) -> _Box | _Sphere | _Cylinder | _Mesh | _MeshPart:
    match shape:
        case Box(size=size):
            return _Box(type="box", size=size)
        case Sphere(radius=radius):
            return _Sphere(type="sphere", radius=radius)
        case Cylinder(radius=radius, length=length):
            return _Cylinder(type="cylinder", radius=radius, length=length)
        case Mesh(uri=uri, scale=scale, part=ConvexPart(index, points, triangles)):
            return _MeshPart(type="mesh_part", uri=uri, scale=scale, index=index, points=points, triangles=triangles)
        case Mesh(uri=uri, scale=scale):
            return _Mesh(type="mesh", uri=uri, scale=scale)


def _read_shape(shape: _Box | _Sphere | _Cylinder | _Mesh | _MeshPart) -> Shape:
    match shape:
        case _Box(size=size):
            return Box(size)
        case _Sphere(radius=radius):
            return Sphere(radius)
        case _Cylinder(radius=radius, length=length):
            return Cylinder(radius, length)
        case _Mesh(uri=uri, scale=scale):
            return Mesh(uri=uri, path=Path(uri), scale=scale)
        case _MeshPart(uri=uri, scale=scale, index=index, points=points, triangles=triangles):
            return Mesh(uri=uri, path=Path(uri), scale=scale, part=ConvexPart(index, points, triangles))


def _hollow(interior: Interior | None) -> _Interior | None:
    if interior is None:
        return None
    shape = interior.shape
    written: _Box | _Cylinder
    if isinstance(shape, Box):
        written = _Box(type="box", size=shape.size)
    else:
        written = _Cylinder(type="cylinder", radius=shape.radius, length=shape.length)
    walls = None if interior.walls is None else _Walls(levels=interior.walls.levels, radii=interior.walls.radii)
    return _Interior(pose=_pose(interior.X_OS), shape=written, walls=walls)


def _read_hollow(interior: _Interior | None) -> Interior | None:
    if interior is None:
        return None
    shape = interior.shape
    hollow = Box(shape.size) if isinstance(shape, _Box) else Cylinder(shape.radius, shape.length)
    walls = None if interior.walls is None else Walls(interior.walls.levels, interior.walls.radii)
    return Interior(X_OS=_transform(interior.pose), shape=hollow, walls=walls)
