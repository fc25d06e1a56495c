"""`sees`: the last picture of a camera shows an object."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.measured import beyond, of_readings, sensed_by, unknown_sensor, unmeasured
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.conditions.touch import is_part, unknown_part
from manipcli.core.geometry import Array
from manipcli.core.prose import named
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import PartName, SensorRef


class SeesSpec(Model):
    """The last picture of a camera shows an object with at least `pixels`."""

    sensor: SensorRef = Field(
        description="The camera, with `segmentation: true`; its last picture that arrived counts."
    )
    object: PartName = Field(description="A body, `robot` or `robot/LINK`.")
    pixels: Annotated[int, Field(ge=1)] = Field(1, description="Least number of pixels, 1 or more. Default 1.")


def monitor(spec: SeesSpec, world: World) -> Monitor:
    """The number of pixels that show the object, minus `pixels`."""
    of_object = np.array([is_part(spec.object, part) for part in world.sensors[spec.sensor].parts])

    def shown(readings: Array) -> Array:
        count: Array = readings[:, of_object].sum(axis=1)  # whole numbers, which are exact
        return count

    def describe(count: float) -> str:
        return f"'{spec.sensor}' sees '{spec.object}' with {count:.0f} pixels; at least {spec.pixels} pixels"

    def look(window: StateWindow) -> Robustness:
        return of_readings(
            window,
            spec.sensor,
            shown,
            lambda count: count - spec.pixels,
            unit="px",
            scale=float(spec.pixels),
            describe=describe,
        )

    return look


def check(spec: SeesSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown camera or object, a camera that does not tell parts apart, or more pixels than it has."""
    found = (*unknown_sensor(context, spec.sensor, ("camera",)), *unknown_part(context, spec.object, ("object",)))
    sensed = None if found else sensed_by(context, spec.sensor)
    if sensed is None:
        return found
    if sensed.parts:
        return beyond(sensed, "pixels", spec.pixels, "px", ("pixels",))
    message = f"camera '{spec.sensor}' does not publish which part each pixel shows"
    return (Problem(("sensor",), message, f"add `segmentation: true` to '{spec.sensor}' under `sensors:`"),)


def clause(spec: SeesSpec, robot: RobotModel) -> str:
    pixels = "one pixel" if spec.pixels == 1 else f"{spec.pixels} pixels"
    return f"camera {named(spec.sensor)} sees {named(spec.object)} with at least {pixels}"


SEES = Condition(
    name="sees",
    spec=SeesSpec,
    units=("px",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmeasured(spec.sensor, world, of_forces=False),
    clause=clause,
    example="sees: {sensor: eye, object: cup, pixels: 200}",
    stateless=True,
    sensor=lambda spec: spec.sensor,
)
