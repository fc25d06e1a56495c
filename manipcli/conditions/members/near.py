"""`near`: an object is close to its start, a body, a named frame, or a point."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.body_poses import point_text
from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, rotate
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.state import WorldState, body_pose
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.quantity import Length
from manipcli.spec.robot import Vector3

START = "start"


class NearSpec(Model):
    """The origin of the object's frame is at most `within` from a target."""

    object: str = Field(description="A body of the scene.")
    to: str | Vector3 = Field(
        description="`start` (the object's position at time 0), a body or a named frame (its origin, which may move), "
        "or a point [x, y, z] in the world."
    )
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest distance [m].")


def monitor(spec: NearSpec, world: World) -> Monitor:
    """`within` minus the distance [m] between the origin of the object's frame and the target."""
    called = "its start" if spec.to == START else f"'{spec.to}'" if isinstance(spec.to, str) else "the point"

    def look(window: StateWindow) -> Robustness:
        p_WO = body_pose(world.scene, window.states, spec.object).position
        target = _target(spec, world, window.states)
        distance = np.broadcast_to(np.linalg.norm(p_WO - target, axis=-1), np.shape(window.times))

        def describe(k: int) -> str:
            away = readable(float(distance[k]), "m")
            where = f"it is at {point_text(p_WO, k)}, the target at {point_text(target, k)}"
            return f"'{spec.object}' is {away} from {called}: {where}; within {readable(spec.within, 'm')}"

        return robustness(spec.within - distance, window.times, unit="m", scale=spec.within, describe=describe)

    return look


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


def check(spec: NearSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown body or target, or the same body twice."""
    scene = context.scene
    problems = unknown_body(scene, spec.object, ("object",))
    if isinstance(spec.to, str):
        known = (START, *(frame.name for frame in scene.frames), *(body.name for body in scene.bodies))
        if spec.to not in known:
            message = f"'{spec.to}' is not `start`, a frame or a body of the scene"
            return (*problems, Problem(("to",), message, did_you_mean(spec.to, known)))
        if spec.to == spec.object != START:
            return (
                Problem(
                    ("to",), f"'{spec.object}' is always near itself", "use `to: start` for its position at time 0"
                ),
            )
    return problems


def bodies(spec: NearSpec, scene: Scene) -> tuple[str, ...]:
    """The object, and the body that the target is or is attached to."""
    parents = {frame.name: frame.parent for frame in scene.frames}
    if not isinstance(spec.to, str) or spec.to == START or parents.get(spec.to) == "world":
        return (spec.object,)
    return (spec.object, parents.get(spec.to, spec.to))


NEAR = Condition(
    name="near",
    spec=NearSpec,
    units=("m",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmoving(world, bodies(spec, world.scene)),
    example="near: {object: cup, to: start, within: 2 cm}",
)
