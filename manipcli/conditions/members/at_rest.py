"""`at_rest`: an object moves slower than a limit."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import cross, rotate
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import body_pose
from manipcli.spec.base import Model
from manipcli.spec.names import BodyName
from manipcli.spec.quantity import Speed


class AtRestSpec(Model):
    """The object's centre moves slower than `below`."""

    object: BodyName = Field(description="A body of the scene.")
    below: Annotated[Speed, Field(gt=0)] = Field(default=0.001, description="Speed [m/s]. Default 1 mm/s.")


def monitor(spec: AtRestSpec, world: World) -> Monitor:
    """`below` minus the speed [m/s] of the object's centre C over the last tick: |v_O + w x R_WO p_OC|."""
    body = world.scene.body(spec.object)

    def look(window: StateWindow) -> Robustness:
        speed = np.zeros(len(window.times))
        if not body.fixed:
            linear, angular = window.body_velocity(world.scene.movable.index(body))
            arm = rotate(body_pose(world.scene, window.states, spec.object).quat_xyzw, body.centre)
            speed = np.linalg.norm(linear + cross(angular, arm), axis=-1)

        def describe(k: int) -> str:
            return f"'{spec.object}' moves at {readable(float(speed[k]), 'm/s')}; below {readable(spec.below, 'm/s')}"

        return robustness(spec.below - speed, window.times, unit="m/s", scale=spec.below, describe=describe)

    return look


def check(spec: AtRestSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown body."""
    return unknown_body(context.scene, spec.object, ("object",))


def clause(spec: AtRestSpec, robot: RobotModel) -> str:
    return f"{named(spec.object)} is at rest, slower than {amount(spec.below, 'm/s')}"


AT_REST = Condition(
    name="at_rest",
    spec=AtRestSpec,
    units=("m/s",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object,)),
    clause=clause,
    example="at_rest: {object: cup}",
)
