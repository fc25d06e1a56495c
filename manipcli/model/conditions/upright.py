"""`upright`: an object stands, its z axis up."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array, rotate
from manipcli.model.condition import Condition, Problem, World, unknown_body
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.state import WorldState, body_pose
from manipcli.spec.base import Model
from manipcli.spec.quantity import Angle


class UprightSpec(Model):
    """The object's z axis is at most `within` from the world's."""

    object: str = Field(description="A body of the scene.")
    within: Annotated[Angle, Field(gt=0)] = Field(description="Largest tilt [rad].")


def margin(spec: UprightSpec, world: World, state: WorldState) -> Array:
    """`within` minus the tilt [rad] (...), the angle between the object's z axis and the world's, 0 to pi."""
    z_W = rotate(body_pose(world.scene, state, spec.object).quat_xyzw, np.array([0.0, 0.0, 1.0]))
    # atan2 and not arccos: exact near 0, where the margin is judged.
    tilt = np.arctan2(np.hypot(z_W[..., 0], z_W[..., 1]), z_W[..., 2])
    return np.broadcast_to(spec.within - tilt, np.shape(state.time)).copy()


def check(spec: UprightSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """The body exists."""
    return unknown_body(scene, spec.object, ("object",))


UPRIGHT = Condition(
    name="upright",
    spec=UprightSpec,
    unit="rad",
    margin=margin,
    bodies=lambda spec, scene: (spec.object,),
    check=check,
)
