"""`inside`: an object is in the hollow of a container."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array, rotate, rotate_inverse
from manipcli.core.text import did_you_mean
from manipcli.model.condition import Condition, Problem, World, unknown_body
from manipcli.model.robot import Cylinder, RobotModel
from manipcli.model.scene import Interior, Scene
from manipcli.model.state import WorldState, body_pose
from manipcli.spec.base import Model


class InsideSpec(Model):
    """The object's centre is inside the hollow of the container `of` (a cup, a tray), below its rim."""

    object: str = Field(description="A body of the scene; its centre is what counts.")
    of: str = Field(description="A body with a hollow: a cup or a tray.")


def margin(spec: InsideSpec, world: World, state: WorldState) -> Array:
    """Depth [m] (...) of the object's centre in the hollow: the distance to its nearest face, negative outside.

    The faces are the hollow's walls, its floor and the plane of its rim. Outside it is minus the distance to the
    hollow. The centre of the object's bounding box is taken, for every shape: a ball that lies on the floor of a
    deep tray has the margin of its radius, and touching a wall takes nothing away.
    """
    content, container = world.scene.body(spec.object), world.scene.body(spec.of)
    interior = container.interior
    if interior is None:
        raise ValueError(f"'{spec.of}' has no inside")
    X_WO, X_WC = body_pose(world.scene, state, spec.object), body_pose(world.scene, state, spec.of)
    p_W = X_WO.position + rotate(X_WO.quat_xyzw, content.centre)
    p_C = rotate_inverse(X_WC.quat_xyzw, p_W - X_WC.position)
    p_S = (p_C - interior.X_OS.p) @ interior.X_OS.R
    return np.broadcast_to(_depth(interior, p_S), np.shape(state.time)).copy()


def _depth(interior: Interior, p_S: Array) -> Array:
    """Minus the signed distance of points (..., 3) to a box or cylinder centred at S.

    With d the distances beyond each pair of faces: distance = |max(d, 0)| + min(max_i d_i, 0).
    """
    shape = interior.shape
    if isinstance(shape, Cylinder):
        radial = np.hypot(p_S[..., 0], p_S[..., 1]) - shape.radius
        d = np.stack([radial, np.abs(p_S[..., 2]) - shape.length / 2.0], axis=-1)
    else:
        d = np.abs(p_S) - np.array(shape.size) / 2.0
    outside = np.linalg.norm(np.maximum(d, 0.0), axis=-1)
    return np.asarray(-(outside + np.minimum(np.max(d, axis=-1), 0.0)))


def check(spec: InsideSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Both bodies exist, differ, and the container has a hollow."""
    problems = [*unknown_body(scene, spec.object, ("object",)), *unknown_body(scene, spec.of, ("of",))]
    if problems:
        return tuple(problems)
    container = scene.body(spec.of)
    if container.interior is None:
        hollow = [body.name for body in scene.bodies if body.interior is not None]
        message = f"'{spec.of}' is a {container.kind} and has no inside"
        problems.append(Problem(("of",), message, did_you_mean(spec.of, hollow)))
    elif spec.of == spec.object:
        problems.append(Problem(("of",), f"'{spec.of}' cannot be inside itself"))
    return tuple(problems)


INSIDE = Condition(
    name="inside",
    spec=InsideSpec,
    unit="m",
    margin=margin,
    bodies=lambda spec, scene: (spec.object, spec.of),
    check=check,
)
