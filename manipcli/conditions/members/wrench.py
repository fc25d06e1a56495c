"""`wrench`: a force/torque sensor measures a force or a torque between limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.measured import beyond, of_readings, sensed_by, unknown_sensor, unmeasured
from manipcli.conditions.robustness import Robustness, least
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model, problem
from manipcli.spec.names import SensorRef
from manipcli.spec.quantity import Force, Torque

AXES = {"x": 0, "y": 1, "z": 2}
Axis = Literal["x", "y", "z", "magnitude"]


def _limited(below: float | None, above: float | None, unit: str) -> None:
    if below is None and above is None:
        raise problem("conflict", "limit missing: give `below`, `above` or both")
    if below is not None and above is not None and above >= below:
        message = f"`above` {readable(above, unit)} is not less than `below` {readable(below, unit)}"
        hint = "`above` is the least value, `below` the largest: swap them"
        raise problem("conflict", message, at=("above",), hint=hint)


class ForceLimits(Model):
    """Limits of the force."""

    axis: Axis = Field(
        "magnitude", description="`x`, `y` or `z` of the sensor frame, or `magnitude`. Default `magnitude`."
    )
    below: Force | None = Field(None, description="Largest force [N].")
    above: Force | None = Field(None, description="Least force [N].")

    @model_validator(mode="after")
    def _whole(self) -> ForceLimits:
        _limited(self.below, self.above, "N")
        return self


class TorqueLimits(Model):
    """Limits of the torque."""

    axis: Axis = Field(
        "magnitude", description="`x`, `y` or `z` of the sensor frame, or `magnitude`. Default `magnitude`."
    )
    below: Torque | None = Field(None, description="Largest torque [N m].")
    above: Torque | None = Field(None, description="Least torque [N m].")

    @model_validator(mode="after")
    def _whole(self) -> TorqueLimits:
        _limited(self.below, self.above, "N m")
        return self


Limits = ForceLimits | TorqueLimits


def _bounds(limits: Limits) -> tuple[tuple[str, float], ...]:
    """The words and values of the limits that are given."""
    both = (("above", limits.above), ("below", limits.below))
    return tuple((word, limit) for word, limit in both if limit is not None)


class WrenchSpec(Model):
    """What a `force_torque` sensor measures, in its frame, is `below` and/or `above` a limit."""

    sensor: SensorRef = Field(description="The sensor; its last measurement that arrived counts.")
    force: ForceLimits | None = Field(
        None,
        description="`below` and/or `above` [N], and `axis`: `x`, `y` or `z` of the sensor frame, or `magnitude`. "
        "Default: no limits.",
    )
    torque: TorqueLimits | None = Field(None, description="The same for the torque [N m]. Default: no limits.")

    @model_validator(mode="after")
    def _whole(self) -> WrenchSpec:
        if self.force is None and self.torque is None:
            hint = "write `force: {axis: z, above: 9 N, below: 11 N}`"
            raise problem("conflict", "limits missing: give `force`, `torque` or both", hint=hint)
        return self

    @property
    def limited(self) -> Iterator[tuple[str, str, int, Limits]]:
        """Quantity, unit, first column and limits of what it limits."""
        if self.force is not None:
            yield "force", "N", 0, self.force
        if self.torque is not None:
            yield "torque", "N m", 3, self.torque


def monitor(spec: WrenchSpec, world: World) -> Monitor:
    """The distance of the measured component, or of the magnitude, to the nearer limit [N or N m].

    In a combination of different units it is divided by this limit, a limit of 0 by 1 N or 1 N m.
    """
    looks = [
        _bounded(spec.sensor, quantity, unit, first, limits, word)
        for quantity, unit, first, limits in spec.limited
        for word, _ in _bounds(limits)
    ]
    return lambda window: least([look(window) for look in looks])


def _bounded(sensor: str, quantity: str, unit: str, first: int, limits: Limits, word: str) -> Monitor:
    bounds = _bounds(limits)
    limit, sign = dict(bounds)[word], 1.0 if word == "above" else -1.0
    along = "" if limits.axis == "magnitude" else f" along {limits.axis}"
    words = " and ".join(f"{name} {readable(value, unit)}" for name, value in bounds)

    def component(readings: Array) -> Array:
        if limits.axis == "magnitude":
            return np.asarray(np.sqrt((readings[:, first : first + 3] ** 2).sum(axis=1)))
        return readings[:, first + AXES[limits.axis]]

    def look(window: StateWindow) -> Robustness:
        return of_readings(
            window,
            sensor,
            component,
            lambda value: sign * (value - limit),
            unit=unit,
            scale=abs(limit) or 1.0,
            describe=lambda value: f"the {quantity}{along} on '{sensor}' is {readable(value, unit)}; {words}",
        )

    return look


def clause(spec: WrenchSpec, robot: RobotModel) -> str:
    parts = []
    for quantity, unit, _, limits in spec.limited:
        along = "" if limits.axis == "magnitude" else f" along {limits.axis}"
        bounds = [f"{word} {amount(limit, unit)}" for word, limit in _bounds(limits)]
        parts.append(f"the {quantity}{along} that sensor {named(spec.sensor)} measures is {' and '.join(bounds)}")
    return ", and ".join(parts)


def check(spec: WrenchSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown sensor, one of another type, or a limit beyond what it measures."""
    unknown = unknown_sensor(context, spec.sensor, ("force_torque",))
    sensed = None if unknown else sensed_by(context, spec.sensor)
    if sensed is None:
        return unknown
    found: list[Problem] = []
    for quantity, unit, _, limits in spec.limited:
        times = np.sqrt(3.0) if limits.axis == "magnitude" else 1.0
        for word, limit in _bounds(limits):
            least = limit if word == "above" else -limit
            found += beyond(sensed, quantity, least, unit, (quantity, word), times=times)
    return tuple(found)


WRENCH = Condition(
    name="wrench",
    spec=WrenchSpec,
    units=("N", "N m"),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmeasured(spec.sensor, world, of_forces=True),
    clause=clause,
    example="wrench: {sensor: wrist, force: {axis: z, above: 9 N, below: 11 N}}",
    stateless=True,
    sensor=lambda spec: spec.sensor,
)
