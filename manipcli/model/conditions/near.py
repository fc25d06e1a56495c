"""`near`: an object is close to where it started, to a body, a named frame, or a point."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array, rotate
from manipcli.core.text import did_you_mean
from manipcli.model.condition import Condition, Problem, World, unknown_body
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState, body_pose
from manipcli.spec.base import Model
from manipcli.spec.quantity import Length
from manipcli.spec.robot import Vector3

START = "start"


class NearSpec(Model):
    """The origin of the object's frame is at most `within` from a target."""

    object: str = Field(description="A body of the scene.")
    to: str | Vector3 = Field(
        description="`start` (where the object was at time 0), a body or a named frame (its origin, which may move), "
        "or a point [x, y, z] in the world."
    )
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest distance [m].")


def margin(spec: NearSpec, world: World, state: WorldState) -> Array:
    """`within` minus the distance [m] (...) between the origin of the object's frame and the target."""
    p_WO = body_pose(world.scene, state, spec.object).position
    distance = np.linalg.norm(p_WO - _target(spec, world, state), axis=-1)
    return np.broadcast_to(spec.within - distance, np.shape(state.time)).copy()


def _target(spec: NearSpec, world: World, state: WorldState) -> Array:
    """The target point in the world (..., 3) or (3,)."""
    if not isinstance(spec.to, str):
        return np.array(spec.to)
    if spec.to == START:
        return body_pose(world.scene, world.start, spec.object).position
    for frame in world.scene.frames:
        if frame.name == spec.to:
            if frame.parent == "world":
                return frame.X_PF.p
            X_WP = body_pose(world.scene, state, frame.parent)
            return np.asarray(X_WP.position + rotate(X_WP.quat_xyzw, frame.X_PF.p))
    return body_pose(world.scene, state, spec.to).position


def check(spec: NearSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """The body exists, and so does the target."""
    problems = unknown_body(scene, spec.object, ("object",))
    if isinstance(spec.to, str):
        known = (START, *(frame.name for frame in scene.frames), *(body.name for body in scene.bodies))
        if spec.to not in known:
            message = f"'{spec.to}' is neither `start` nor a frame or body of the scene"
            return (*problems, Problem(("to",), message, did_you_mean(spec.to, known)))
    return problems


def bodies(spec: NearSpec, scene: Scene) -> tuple[str, ...]:
    """The object, and the body that the target is or hangs on."""
    parents = {frame.name: frame.parent for frame in scene.frames}
    if not isinstance(spec.to, str) or spec.to == START or parents.get(spec.to) == "world":
        return (spec.object,)
    return (spec.object, parents.get(spec.to, spec.to))


NEAR = Condition(name="near", spec=NearSpec, unit="m", margin=margin, bodies=bodies, check=check)
