"""Placeholders for a scene or robot that cannot be built, to check the names of a task nevertheless.

Nothing is planned or simulated with them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from manipcli.conditions.touch import ROBOT
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import Group, NamedPose, RobotModel, Tool
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import SEPARATOR, Body, Frame, Interior, Scene
from manipcli.shapes.primitives import Box
from manipcli.spec.counted import flat_scene
from manipcli.spec.task import TaskSpec


def named_scene(spec: TaskSpec) -> Scene:
    """A scene with the names of the task's bodies and frames. Every body fits every use, so that only unknown names
    are reported."""
    box, scene = Box((1.0, 1.0, 1.0)), flat_scene(spec.scene)
    inner = [  # what may be a link, a part or a joint of a body from a file
        word
        for word in dict.fromkeys(_words(spec.model_dump(serialize_as_any=True)))
        if (own := scene.get(word.partition(SEPARATOR)[0])) is not None and own.urdf is not None and SEPARATOR in word
    ]
    origin = Transform.identity()
    bodies = tuple(
        Body(
            name=name, kind="", geometries=(), mass=1.0, X_OI=origin, inertia=frozen(np.eye(3)), friction=0.0,
            rolling_friction=0.0, spinning_friction=0.0, restitution=0.0, fixed=name == "floor", X_WO=origin,
            interior=Interior(X_OS=origin, shape=box), size=frozen([1.0, 1.0, 1.0]), centre=frozen([0.0, 0.0, 0.0]),
        )
        for name in (*(("floor",) if spec.floor else ()), *scene, *inner)
    )  # fmt: skip
    parts = (f"{name}{SEPARATOR}{part}" for name, body in scene.items() for part in body.parts or ())
    frames = tuple(Frame(name=name, parent="world", X_PF=origin) for name in (*spec.frames, *parts, *inner))
    axis, files = frozen([0.0, 0.0, 1.0]), [name for name, body in scene.items() if body.urdf is not None]
    joints = tuple(
        SceneJoint(name, "continuous", "world", name.removesuffix(SEPARATOR), origin, axis, -math.inf, math.inf)
        for name in (*inner, *(f"{name}{SEPARATOR}" for name in files))
    )
    return Scene(bodies=bodies, frames=frames, gravity=frozen([0.0, 0.0, -1.0]), joints=joints)


def named_robot(spec: TaskSpec) -> RobotModel:
    """A robot that accepts every name: each word of the task is a pose, a group, a joint and a link, so that only
    errors with any robot are reported."""
    words = tuple(dict.fromkeys(_words(spec.model_dump(serialize_as_any=True))))
    links = dict.fromkeys(name for word in words for name in (word, word.removeprefix(f"{ROBOT}/")))
    limits = JointLimits(lower=-np.inf, upper=np.inf, velocity=np.inf, effort=np.inf)
    axis, origin = frozen([0.0, 0.0, 1.0]), Transform.identity()
    return RobotModel(
        name="", root="", urdf="", transmissions=(), X_WB=origin, tool=Tool("", origin),
        links=tuple(Link(name, None, (), ()) for name in links),
        joints=tuple(Joint(name, "revolute", "", name, origin, axis, limits) for name in words),
        groups=tuple(Group(name, words) for name in words),
        poses=tuple(NamedPose(name, words, (0.0,) * len(words)) for name in words),
    )  # fmt: skip


def _words(data: object) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict):
        for key, value in data.items():
            yield str(key)
            yield from _words(value)
    elif isinstance(data, list | tuple):
        for value in data:
            yield from _words(value)
