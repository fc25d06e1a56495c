"""Spec of a simulation: its engine and clock."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from manipcli.core.units import EARTH_GRAVITY
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Acceleration, Time


class SimulationSpec(Model):
    """Engine and clock. `control_period` is a whole multiple of `step`; `settle` is simulated before the start."""

    # `unions.task_model` adds the settings of each engine, in a field with its name.
    engine: str = Field("pybullet", description="Engine. Default pybullet.")
    step: Annotated[Time, Field(ge=1e-6, le=0.02, description="Physics step, 1 us to 20 ms. Default 1 ms.")] = 0.001
    control_period: Annotated[
        Time, Field(gt=0, le=0.05, description="Control period, a whole multiple of `step`, up to 50 ms. Default 1 ms.")
    ] = 0.001
    seed: Annotated[int, Field(ge=0, description="Seed of the planner and of samples, 0 or more. Default 0.")] = 0
    gravity: tuple[Acceleration, Acceleration, Acceleration] = Field(
        EARTH_GRAVITY, description="Gravity in the world frame [m/s^2]. Default [0, 0, -9.81]."
    )
    settle: Annotated[
        Time, Field(ge=0, le=60, description="Time simulated before the start, 0 to 60 s. Default 0.5 s.")
    ] = 0.5
    self_collision: bool = Field(
        True,
        description="Whether links of the robot collide with each other, in engines with physics: the pairs that "
        "planning checks, and those within a hand. Default true.",
    )

    @property
    def own(self) -> Model | None:
        """The selected engine's own settings; None for an engine without any, or an unknown engine."""
        own = getattr(self, self.engine, None) if self.engine in type(self).model_fields else None
        return own if isinstance(own, Model) else None

    @model_validator(mode="after")
    def _whole_steps(self) -> SimulationSpec:
        steps = self.control_period / self.step
        if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
            message = (
                f"control_period ({self.control_period:g} s) must be a whole multiple of step ({self.step:g} s), "
                f"not {steps:.6g} times"
            )
            below = max(1, round(steps)) * self.step
            raise problem("conflict", message, at=("control_period",), hint=f"write {below:g}, or change `step`")
        return self
