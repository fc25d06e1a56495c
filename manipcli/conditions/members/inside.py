"""`inside`, `outside`: the centre of an object is in the hollow of a container, or is not."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydantic import Field

from manipcli.conditions.body_poses import centres, point_text
from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, rotate_inverse
from manipcli.core.prose import named
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState, body_pose
from manipcli.scene.scene import Interior, Scene
from manipcli.shapes.primitives import Cylinder
from manipcli.spec.base import Model
from manipcli.spec.names import BodyName, ContainerName


class InsideSpec(Model):
    """The object's centre is inside the hollow of the container `of`, below its rim."""

    object: BodyName = Field(description="A body of the scene; its centre counts.")
    of: ContainerName = Field(description="A body with a hollow: a cup, a tray, a mesh or URDF that is open upwards.")


class OutsideSpec(Model):
    """The object's centre is not inside the hollow of the container `of`."""

    object: BodyName = Field(description="A body of the scene; its centre counts.")
    of: ContainerName = Field(description="A body with a hollow: a cup, a tray, a mesh or URDF that is open upwards.")


Spec = InsideSpec | OutsideSpec


def monitor(spec: Spec, world: World, *, sign: float) -> Monitor:
    """Depth [m] of the object's centre in the hollow: the distance to its nearest face, negative outside.

    The faces are the walls and the floor of the hollow and the plane of its rim. Outside, the margin is minus the
    distance to the hollow. For every shape the centre is that of its bounding box: a ball on the floor of a deep tray
    has its radius as margin; the distance to a wall that is neither upright nor round is a level one. `outside` is the
    opposite. Where units differ, the margin is divided by the greatest
    depth in the hollow.
    """
    interior = _interior(world.scene, spec.of)
    shape = interior.shape
    deepest = min(shape.radius, shape.length / 2.0) if isinstance(shape, Cylinder) else min(shape.size) / 2.0

    def look(window: StateWindow) -> Robustness:
        p_S = _in_hollow(world.scene, window.states, spec)
        depth = np.broadcast_to(_depth(interior, p_S), np.shape(window.states.time))

        def describe(k: int) -> str:
            far = readable(abs(float(depth[k])), "m")
            where = f"{far} deep in '{spec.of}'" if depth[k] >= 0.0 else f"{far} outside '{spec.of}'"
            if depth[k] < 0.0 and _over(interior, np.broadcast_to(p_S, (*depth.shape, 3))[k]):
                where += ", above its rim"
            at = point_text(centres(world.scene, window.states, spec.object), k)
            return f"'{spec.object}' is {where}, its centre at {at}"

        return robustness(sign * depth, window.times, unit="m", scale=deepest, describe=describe)

    return look


def _interior(scene: Scene, name: str) -> Interior:
    interior = scene.body(name).interior
    if interior is None:
        raise ValueError(f"'{name}' has no hollow")
    return interior


def _in_hollow(scene: Scene, states: WorldState, spec: Spec) -> Array:
    """p_SC (..., 3): the object's centre C in the frame S at the centre of the hollow."""
    interior = _interior(scene, spec.of)
    X_WO = body_pose(scene, states, spec.of)
    p_O = rotate_inverse(X_WO.quat_xyzw, centres(scene, states, spec.object) - X_WO.position)
    return np.asarray((p_O - interior.X_OS.p) @ interior.X_OS.R)


def _depth(interior: Interior, p_S: Array) -> Array:
    """Minus the signed distance of points (..., 3) to a hollow.

    With d the distances beyond each pair of faces: distance = |max(d, 0)| + min(max_i d_i, 0).
    """
    d = _beyond(interior, p_S)
    outside = np.linalg.norm(np.maximum(d, 0.0), axis=-1)
    return np.asarray(-(outside + np.minimum(np.max(d, axis=-1), 0.0)))


def _beyond(interior: Interior, p_S: Array) -> Array:
    """Distance of points (..., 3) beyond each pair of faces [m]; the last pair is floor and rim."""
    shape = interior.shape
    if interior.walls is not None:
        upright = np.maximum(interior.floor - p_S[..., 2], p_S[..., 2] - interior.rim)
        return np.stack([-interior.walls.room(p_S), upright], axis=-1)
    if isinstance(shape, Cylinder):
        radial = np.hypot(p_S[..., 0], p_S[..., 1]) - shape.radius
        return np.stack([radial, np.abs(p_S[..., 2]) - shape.length / 2.0], axis=-1)
    return np.asarray(np.abs(p_S) - np.array(shape.size) / 2.0)


def _over(interior: Interior, p_S: Array) -> bool:
    """Whether a point (3,) outside is above the rim and between the walls."""
    return bool(p_S[2] > 0.0 and (_beyond(interior, p_S)[:-1] <= 0.0).all())


def check(spec: Spec, context: CheckContext) -> tuple[Problem, ...]:
    """Unknown bodies, the same body twice, or a container without a hollow."""
    scene = context.scene
    problems = [*unknown_body(scene, spec.object, ("object",)), *unknown_body(scene, spec.of, ("of",))]
    if problems:
        return tuple(problems)
    container = scene.body(spec.of)
    if container.interior is None:
        hollow = [body.name for body in scene.bodies if body.interior is not None]
        message = f"'{spec.of}' is a {container.kind} and has no hollow"
        problems.append(Problem(("of",), message, did_you_mean(spec.of, hollow)))
    elif spec.of == spec.object:
        problems.append(Problem(("of",), f"'{spec.of}' cannot be inside itself"))
    return tuple(problems)


def clause(spec: InsideSpec | OutsideSpec, robot: RobotModel) -> str:
    return f"{named(spec.object)} is {'inside' if isinstance(spec, InsideSpec) else 'outside'} {named(spec.of)}"


INSIDE = Condition(
    name="inside",
    spec=InsideSpec,
    units=("m",),
    open=partial(monitor, sign=1.0),
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object, spec.of)),
    clause=clause,
    example="inside: {object: ball, of: tray}",
)
OUTSIDE = Condition(
    name="outside",
    spec=OutsideSpec,
    units=("m",),
    open=partial(monitor, sign=-1.0),
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object, spec.of)),
    clause=clause,
    example="outside: {object: ball, of: cup}",
)
