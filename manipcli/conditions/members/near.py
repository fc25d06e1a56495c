"""`near`: an object, a part of one or the tool is close to its start, a frame, or a point."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.body_poses import point_text
from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.frames import WORDS, carrier, frame_pose, unknown_frame
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, rotate
from manipcli.core.prose import amount, named, point
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model
from manipcli.spec.names import FrameName
from manipcli.spec.quantity import Length
from manipcli.spec.robot import Vector3

START = "start"


class NearSpec(Model):
    """The origin of the object's frame is at most `within` from a target."""

    object: FrameName = Field(description="A body of the scene, a part of one (`cup/rim`), or `tool`.")
    to: FrameName | Literal["start"] | Vector3 = Field(
        description="`start` (the object's position at time 0), a frame (its origin, which may move): a body, a part "
        "of one, a named frame, `base`, `tool` or `robot/LINK`; or a point [x, y, z] in `frame`."
    )
    frame: FrameName | None = Field(None, description="Frame of a point `to: [x, y, z]`. Default: `world`.")
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest distance [m].")


def monitor(spec: NearSpec, world: World) -> Monitor:
    """`within` minus the distance [m] between the origin of the object's frame and the target."""
    called = "its start" if spec.to == START else f"'{spec.to}'" if isinstance(spec.to, str) else "the point"

    def look(window: StateWindow) -> Robustness:
        p_WO = frame_pose(world, window.states, spec.object).position
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
    if isinstance(spec.to, str):
        at_start = spec.to == START
        name = spec.object if at_start else spec.to
        return frame_pose(world, world.start if at_start else state, name).position
    if spec.frame is None:
        return np.array(spec.to)
    X_WF = frame_pose(world, state, spec.frame)
    return np.asarray(X_WF.position + rotate(X_WF.quat_xyzw, spec.to))


def check(spec: NearSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown object or target, or the object itself as target."""
    robot, scene = context.robot, context.scene
    problems: list[Problem] = []
    parted = spec.object == "tool" or "/" in spec.object
    problems += (
        unknown_frame(robot, scene, spec.object, ("object",))
        if parted
        else unknown_body(scene, spec.object, ("object",))
    )
    if isinstance(spec.to, str) and spec.frame is not None:
        message = "`frame` applies to a point `to: [x, y, z]`, not to a name"
        problems.append(Problem(("frame",), message, "remove `frame`"))
    elif spec.frame is not None:
        problems += unknown_frame(robot, scene, spec.frame, ("frame",))
    if not isinstance(spec.to, str) or spec.to == START:
        return tuple(problems)
    unknown = unknown_frame(robot, scene, spec.to, ("to",))
    if unknown and "/" not in spec.to:
        known = (START, *WORDS, *(frame.name for frame in scene.frames), *(body.name for body in scene.bodies))
        message = f"'{spec.to}' is not `start`, a frame or a body of the scene"
        return (*problems, Problem(("to",), message, did_you_mean(spec.to, known)))
    if spec.to == spec.object:
        hint = "use `to: start` for its position at time 0"
        problems.append(Problem(("to",), f"'{spec.object}' is always near itself", hint))
    return (*problems, *unknown)


def bodies(spec: NearSpec, scene: Scene) -> tuple[str, ...]:
    """The bodies that the object and the target are or are attached to."""
    target = spec.to if isinstance(spec.to, str) else spec.frame or "world"
    return tuple(carrier(scene, name) for name in (spec.object, target) if name != START)


def clause(spec: NearSpec, robot: RobotModel) -> str:
    to = f"the point {point(spec.to)}" if isinstance(spec.to, tuple) else f"the origin of {named(spec.to)}"
    if spec.to == "start":
        to = "where it was at the start"
    frame = "" if spec.frame in (None, "world") else f" in the frame of {named(str(spec.frame))}"
    return f"the origin of {named(spec.object)} is within {amount(spec.within, 'm')} of {to}{frame}"


NEAR = Condition(
    name="near",
    spec=NearSpec,
    units=("m",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmoving(world, bodies(spec, world.scene)),
    clause=clause,
    example="near: {object: cup, to: start, within: 2 cm}",
)
