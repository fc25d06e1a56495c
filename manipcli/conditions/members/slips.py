"""`slips`: taxels with shear measure beginning slip."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.measured import of_readings, sensed_by, unknown_sensor, unmeasured
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named, share
from manipcli.model.friction_share import friction_share, grip_forces
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import SensorRef
from manipcli.spec.quantity import Force, Share


class SlipsSpec(Model):
    """The tangential force on a `tactile` sensor uses a share of the friction of at least `onset`."""

    sensor: SensorRef = Field(description="The sensor, with `shear: true`; its last measurement that arrived counts.")
    friction: Annotated[float, Field(gt=0, le=10)] = Field(
        description="Coefficient of friction between the surface and the object, above 0 to 10."
    )
    onset: Annotated[Share, Field(gt=0, le=1)] = Field(
        0.9, description="Least tangential force, as a share of friction times normal force. Default 90 %."
    )
    force: Annotated[Force, Field(gt=0)] = Field(
        0.1, description="Normal force below which nothing touches: it then does not apply. Default 0.1 N."
    )


def monitor(spec: SlipsSpec, world: World) -> Monitor:
    """The used share of the friction, by the sums of all cells, minus `onset`."""

    def used(readings: Array) -> Array:
        return friction_share(*grip_forces(readings), spec.friction)

    def describe(value: float) -> str:
        return f"'{spec.sensor}' measures {share(value)} of the friction; at least {share(spec.onset)}"

    def look(window: StateWindow) -> Robustness:
        return of_readings(
            window,
            spec.sensor,
            used,
            lambda value: value - spec.onset,
            unit="",
            scale=spec.onset,
            describe=describe,
            touched=lambda readings: grip_forces(readings)[0] >= spec.force,
        )

    return look


def check(spec: SlipsSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown sensor, one of another type, or taxels without shear."""
    unknown = unknown_sensor(context, spec.sensor, ("tactile",))
    sensed = None if unknown else sensed_by(context, spec.sensor)
    if sensed is None or sensed.shear:
        return unknown
    message = f"sensor '{spec.sensor}' measures no tangential forces"
    return (Problem(("sensor",), message, f"add `shear: true` to '{spec.sensor}' under `sensors:`"),)


def clause(spec: SlipsSpec, robot: RobotModel) -> str:
    least = f"{share(spec.onset)} of a friction of {spec.friction:g}"
    return f"sensor {named(spec.sensor)} measures beginning slip: {least}, with at least {amount(spec.force, 'N')}"


SLIPS = Condition(
    name="slips",
    spec=SlipsSpec,
    units=("",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmeasured(spec.sensor, world, of_forces=True),
    clause=clause,
    example="slips: {sensor: fingertip, friction: 0.5}",
    stateless=True,
    sensor=lambda spec: spec.sensor,
)
