"""`upright`: the z axis of an object points up."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import rotate
from manipcli.core.prose import amount, named
from manipcli.core.text import distinguished
from manipcli.model.robot import RobotModel
from manipcli.model.state import body_pose
from manipcli.spec.base import Model
from manipcli.spec.names import BodyName
from manipcli.spec.quantity import AngleTolerance


class UprightSpec(Model):
    """The angle between the object's z axis and the world's is at most `within`."""

    object: BodyName = Field(description="A body of the scene.")
    within: AngleTolerance = Field(description="Largest tilt [rad], to pi.")


def monitor(spec: UprightSpec, world: World) -> Monitor:
    """`within` minus the tilt [rad]: the angle between the object's z axis and the world's, 0 to pi."""

    def look(window: StateWindow) -> Robustness:
        z_W = rotate(body_pose(world.scene, window.states, spec.object).quat_xyzw, np.array([0.0, 0.0, 1.0]))
        # atan2 and not arccos: exact near 0, where the margin is judged.
        tilt = np.arctan2(np.hypot(z_W[..., 0], z_W[..., 1]), z_W[..., 2])
        tilts = np.broadcast_to(tilt, np.shape(window.times))

        def describe(k: int) -> str:
            tilted, within = distinguished(math.degrees(tilts[k]), math.degrees(spec.within), form=".3g")
            return f"'{spec.object}' is tilted {tilted} deg; within {within} deg"

        return robustness(spec.within - tilts, window.times, unit="rad", scale=spec.within, describe=describe)

    return look


def check(spec: UprightSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown body."""
    return unknown_body(context.scene, spec.object, ("object",))


def clause(spec: UprightSpec, robot: RobotModel) -> str:
    return f"{named(spec.object)} is upright within {amount(spec.within, 'rad')}"


UPRIGHT = Condition(
    name="upright",
    spec=UprightSpec,
    units=("rad",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object,)),
    clause=clause,
    example="upright: {object: cup, within: 5 deg}",
)
