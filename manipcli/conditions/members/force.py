"""`force`: what the arm feels at its tool, of compliant steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.measured import of_readings, unmeasured
from manipcli.conditions.members.wrench import AXES, Axis
from manipcli.conditions.robustness import least
from manipcli.conditions.sensed import FELT
from manipcli.core.geometry import Array
from manipcli.core.prose import amount
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Force


class FeltForceSpec(Model):
    """The force that the tool exerts, as the arm feels it, is `above`, `below` or `between` limits.

    It is measured by a `force_torque` sensor between arm and tool, or estimated from the efforts of the joints, and
    zeroed when a compliant motion begins. The task must have a compliant step: `press`, or `move` with a `stiffness`.
    """

    of: Literal["tool"] = Field("tool", description="`tool`.")
    axis: Axis = Field("z", description="`x`, `y` or `z` of the tool frame, or `magnitude`. Default `z`.")
    between: tuple[Force, Force] | None = Field(None, description="Least and largest force [N].")
    above: Force | None = Field(None, description="Least force [N], instead of `between`.")
    below: Force | None = Field(None, description="Largest force [N], instead of `between`.")

    @model_validator(mode="after")
    def _limited(self) -> FeltForceSpec:
        single = self.above is not None or self.below is not None
        if self.between is not None and single:
            raise problem("conflict", "`between` already has both limits", hint="remove `above` and `below`")
        if self.between is None and not single:
            raise problem("conflict", "limit missing: give `between: [9 N, 11 N]`, `above` or `below`")
        low, high = self.limits
        if low is not None and high is not None and low >= high:
            message = f"the least force {readable(low, 'N')} is not below the largest, {readable(high, 'N')}"
            raise problem("conflict", message, at=("between" if self.between else "above",), hint="swap them")
        return self

    @property
    def limits(self) -> tuple[float | None, float | None]:
        """The least and the largest force [N]."""
        return (self.above, self.below) if self.between is None else self.between


def monitor(spec: FeltForceSpec, world: World) -> Monitor:
    """The distance of the component, or of the magnitude, to the nearer limit [N].

    Positive forces are along the axis: a tool that presses on a table along its z axis feels +z.
    """
    along = "" if spec.axis == "magnitude" else f" along {spec.axis}"
    words = " and ".join(_bounds(spec, readable))

    def component(readings: Array) -> Array:
        if spec.axis == "magnitude":
            return np.asarray(np.sqrt((readings[:, :3] ** 2).sum(axis=1)))
        return readings[:, AXES[spec.axis]]

    def bounded(limit: float, sign: float) -> Monitor:
        return lambda window: of_readings(
            window,
            FELT,
            component,
            lambda value: sign * (value - limit),
            unit="N",
            scale=abs(limit) or 1.0,
            describe=lambda value: f"the tool presses{along} with {readable(value, 'N')}; {words}",
        )

    low, high = spec.limits
    looks = [bounded(limit, sign) for limit, sign in ((low, 1.0), (high, -1.0)) if limit is not None]
    return lambda window: least([look(window) for look in looks])


def _bounds(spec: FeltForceSpec, text: Callable[[float, str], str]) -> list[str]:
    return [
        f"{word} {text(limit, 'N')}"
        for word, limit in zip(("above", "below"), spec.limits, strict=True)
        if limit is not None
    ]


def clause(spec: FeltForceSpec, robot: RobotModel) -> str:
    along = "" if spec.axis == "magnitude" else f" along its {spec.axis} axis"
    return f"the force that the tool exerts{along} is {' and '.join(_bounds(spec, amount))}"


def check(spec: FeltForceSpec, context: CheckContext) -> tuple[Problem, ...]:
    """A task without a compliant step: nothing is felt."""
    if context.sensors is None or FELT in context.sensors:
        return ()
    hint = "use `press`, or give a `move` a `stiffness`; `contact_force` has the true force of any task"
    return (Problem((), "no step of the task is compliant, so the arm feels nothing", hint),)


FORCE = Condition(
    name="force",
    spec=FeltForceSpec,
    units=("N",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmeasured(FELT, world, of_forces=True),
    clause=clause,
    example="force: {of: tool, axis: z, between: [9 N, 11 N]}",
    stateless=True,
    sensor=lambda spec: FELT,
)
