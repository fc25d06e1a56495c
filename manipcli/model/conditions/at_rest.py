"""`at_rest`: an object does not move."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array, cross, rotate
from manipcli.model.condition import Condition, Problem, World, unknown_body
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState, body_pose
from manipcli.spec.base import Model
from manipcli.spec.quantity import Speed


class AtRestSpec(Model):
    """The object's centre moves slower than `below`."""

    object: str = Field(description="A body of the scene.")
    below: Annotated[Speed, Field(gt=0)] = Field(default=0.001, description="Speed [m/s] under which it is at rest.")


def margin(spec: AtRestSpec, world: World, state: WorldState) -> Array:
    """`below` minus the speed [m/s] (...) of the object's centre: |v_O + w x R_WO c|, c the centre in O."""
    body = world.scene.body(spec.object)
    if body.fixed:
        return np.full(np.shape(state.time), spec.below)
    k = world.scene.movable.index(body)
    arm = rotate(body_pose(world.scene, state, spec.object).quat_xyzw, body.centre)
    velocity = state.body_linear[..., k, :] + cross(state.body_angular[..., k, :], arm)
    return np.asarray(spec.below - np.linalg.norm(velocity, axis=-1))


def check(spec: AtRestSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """The body exists."""
    return unknown_body(scene, spec.object, ("object",))


AT_REST = Condition(
    name="at_rest",
    spec=AtRestSpec,
    unit="m/s",
    margin=margin,
    bodies=lambda spec, scene: (spec.object,),
    check=check,
)
