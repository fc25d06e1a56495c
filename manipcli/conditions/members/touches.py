"""`touches`: a sensor of touch measures a force."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.measured import beyond, of_readings, sensed_by, unknown_sensor, unmeasured
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import SensorRef
from manipcli.spec.quantity import Force

TYPES = ("contact", "tactile")


class TouchesSpec(Model):
    """A `contact` or `tactile` sensor measures at least `force`, in the sum of all its cells."""

    sensor: SensorRef = Field(description="The sensor; its last measurement that arrived counts.")
    force: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="Least force [N], above 0. Default: the threshold of a `contact` sensor."
    )


def monitor(spec: TouchesSpec, world: World) -> Monitor:
    """The measured sum of the normal forces minus `force` [N]."""
    sensed = world.sensors[spec.sensor]
    least = spec.force or sensed.threshold or 0.0

    def total(readings: Array) -> Array:
        force: Array = readings[:, : sensed.forces].sum(axis=1)
        return force

    def describe(force: float) -> str:
        return f"'{spec.sensor}' measures {readable(force, 'N')}; at least {readable(least, 'N')}"

    def look(window: StateWindow) -> Robustness:
        return of_readings(
            window, spec.sensor, total, lambda force: force - least, unit="N", scale=least, describe=describe
        )

    return look


def check(spec: TouchesSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown sensor, one of another type, a missing force, and one above its limits."""
    unknown = unknown_sensor(context, spec.sensor, TYPES)
    sensed = None if unknown else sensed_by(context, spec.sensor)
    if sensed is None:
        return unknown
    if spec.force is not None:
        return beyond(sensed, "force", spec.force, "N", ("force",), times=sensed.forces)
    if sensed.threshold is not None:
        return ()
    message = f"`force` is missing: sensor '{spec.sensor}' of type `{sensed.type}` has no threshold"
    return (Problem((), message, "add `force: 0.5 N`"),)


def clause(spec: TouchesSpec, robot: RobotModel) -> str:
    least = "its threshold" if spec.force is None else amount(spec.force, "N")
    return f"sensor {named(spec.sensor)} measures a force of at least {least}"


TOUCHES = Condition(
    name="touches",
    spec=TouchesSpec,
    units=("N",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmeasured(spec.sensor, world, of_forces=True),
    clause=clause,
    example="touches: {sensor: fingertip, force: 0.5 N}",
    stateless=True,
    sensor=lambda spec: spec.sensor,
)
