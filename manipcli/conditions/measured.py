"""What conditions on sensors have in common: their checks, and their margins on the readings that hold at each tick."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manipcli.conditions.condition import CheckContext, Problem, World
from manipcli.conditions.robustness import Mask, Robustness, robustness
from manipcli.conditions.sensed import Sensed
from manipcli.conditions.state_window import StateWindow
from manipcli.core.errors import Loc
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean, listed
from manipcli.core.units import readable


def unmeasured(sensor: str, world: World, *, of_forces: bool) -> str | None:
    """Why the readings of a sensor are unknown; None if they are known. `of_forces`: they need physics."""
    if of_forces and not world.physics:
        return "the engine has no physics, so there are no forces"
    if "sensors" in world.unrecorded:
        return world.unrecorded["sensors"]
    return None if sensor in world.sensors else f"the log has no topic of sensor '{sensor}'"


def unknown_sensor(context: CheckContext, name: str, types: tuple[str, ...]) -> tuple[Problem, ...]:
    """A problem if the task has no sensor of this name, or one of a type that the condition cannot use."""
    sensors = context.sensors
    if sensors is None:
        return ()
    fitting = [other for other, sensed in sensors.items() if sensed.type in types]
    wanted = " or ".join(f"`{word}`" for word in types)
    if name not in sensors:
        hint = did_you_mean(name, fitting, kind="sensors")
        if not fitting:
            hint = f"add a sensor of the type {wanted} under `sensors:`"
        return (Problem(("sensor",), f"'{name}' is not a sensor of the task or its robot", hint),)
    if sensors[name].type not in types:
        message = f"sensor '{name}' is of type `{sensors[name].type}`; the condition needs {wanted}"
        return (Problem(("sensor",), message, f"such sensors: {listed(fitting)}" if fitting else None),)
    return ()


def sensed_by(context: CheckContext, name: str) -> Sensed | None:
    """The sensor, None if sensors are unknown."""
    return None if context.sensors is None else context.sensors[name]


def beyond(
    sensed: Sensed, quantity: str, least: float, unit: str, loc: Loc, *, times: float = 1.0
) -> tuple[Problem, ...]:
    """A problem if no reading of a sensor can be as large as `least`; `times`: what a number of it is multiplied by."""
    most = times * sensed.most.get(quantity, np.inf)
    if least <= most:
        return ()
    found, wanted = (readable(value, unit, digits=7) for value in (most, least))
    message = f"it never holds: the sensor measures at most {found}, not {wanted}"
    return (Problem(loc, message, "lower it, or raise the range of the sensor under `sensors:`"),)


def of_readings(
    window: StateWindow,
    sensor: str,
    value: Callable[[Array], Array],
    margin: Callable[[Array], Array],
    *,
    unit: str,
    scale: float,
    describe: Callable[[float], str],
    touched: Callable[[Array], Mask] | None = None,
) -> Robustness:
    """Margins of a value of the reading that holds at each tick; it does not apply before the first arrival.

    Args:
        window, sensor: where the readings are.
        value: (K, width) readings -> (K,) values.
        margin: (T,) values -> (T,) margins in `unit`.
        unit, scale: see `robustness`.
        describe: value -> text.
        touched: (K, width) readings -> (K,) False where it does not apply because nothing touches the sensor.
    """
    readings = window.readings[sensor]
    index, known = readings.at(window.times)
    values = np.full(len(index), np.nan)
    applies = known
    if known.any():
        values[known] = value(readings.values)[index[known]]
        applies = known if touched is None else known & touched(readings.values)[index]
    return robustness(
        margin(values),
        window.times,
        unit=unit,
        scale=scale,
        describe=lambda k: describe(float(values[k])),
        applies=applies,
        idle=f"nothing touches '{sensor}'" if known.all() else f"no measurement of sensor '{sensor}' has arrived",
    )
