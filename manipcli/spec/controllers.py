"""Spec of a controller: keys of every type, and blocks that several types share."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import (
    Frequency,
    JointAcceleration,
    JointTolerance,
    JointValue,
    JointVelocity,
    Time,
)

Interface = Literal["position", "velocity", "acceleration", "effort"]
Role = Literal["follower", "hand", "other"]
"""What steps use a controller for: to follow trajectories, to move a hand, or nothing."""


class ControllerSpec(Model):
    """Keys of every controller."""

    role: ClassVar[Role] = "other"

    type: str = Field(description="Type of the controller, which selects its control law.")
    joints: tuple[str, ...] = Field((), description="Joints that it commands or reads.")
    active: bool = Field(True, description="Whether it is active at the start. Default true.")
    update_rate: Annotated[Frequency, Field(gt=0)] | None = Field(
        None, description="Update rate [Hz]; must divide the control rate. Default: the control rate."
    )

    @model_validator(mode="after")
    def _each_joint_once(self) -> Self:
        for k, name in enumerate(self.joints):
            if name in self.joints[:k]:
                raise problem("duplicate", f"duplicate joint '{name}'", at=("joints", k))
        return self

    def ticks(self, period: float) -> int:
        """Control ticks of `period` [s] per update; `update_rate` must divide the control rate."""
        return 1 if self.update_rate is None else max(1, round(1.0 / (self.update_rate * period)))

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """Command interfaces that it claims on each of its joints."""
        return ()

    @property
    def references(self) -> tuple[Interface, ...]:
        """References of each of its joints that another controller may command."""
        return ()


class ChainableSpec(ControllerSpec):
    """A controller that may command the references of another one."""

    chained_to: str | None = Field(
        None,
        description="Name of a `pid` whose references it commands, instead of the joints; that one has the same joints "
        "and is active with it. Default: it commands the joints.",
    )


AntiWindup = Literal["none", "back_calculation", "conditional_integration"]


MOST_GAIN: Final = 1e12
"""Upper bound of gains, far above any real joint: products of larger gains could overflow."""


class GainsSpec(Model):
    """PID gains of one joint. Units follow the command interface (effort: N m/rad, N m s/rad, N m/(rad s))."""

    p: Annotated[float, Field(ge=0, le=MOST_GAIN, description="Proportional, 0 or more. Default 0.")] = 0.0
    i: Annotated[float, Field(ge=0, le=MOST_GAIN, description="Integral, 0 or more. Default 0.")] = 0.0
    d: Annotated[float, Field(ge=0, le=MOST_GAIN, description="Derivative, 0 or more. Default 0.")] = 0.0
    i_clamp: Annotated[float, Field(ge=0)] | None = Field(
        None, description="Largest effort of the integral term, 0 or more. Default: unlimited."
    )
    i_clamp_min: Annotated[float, Field(le=0)] | None = Field(
        None, description="Smallest effort of the integral term, 0 or less. Default: -i_clamp."
    )
    i_clamp_max: Annotated[float, Field(ge=0)] | None = Field(
        None, description="Largest effort of the integral term, 0 or more. Default: i_clamp."
    )
    u_clamp_min: float | None = Field(None, description="Smallest command. Default: unlimited.")
    u_clamp_max: float | None = Field(None, description="Largest command, above u_clamp_min. Default: unlimited.")
    antiwindup_strategy: AntiWindup = Field(
        "none",
        description="What the integral does while the command is clamped: `none`, `back_calculation` or "
        "`conditional_integration`. Default none.",
    )
    antiwindup: bool = Field(
        False,
        description="Only with `compat: ros1`: clamp the integral of the error itself, not only its term. "
        "Otherwise the integral is always clamped. Default false.",
    )
    tracking_time_constant: Annotated[Time, Field(ge=0)] = Field(
        0.0, description="Time constant of back calculation, 0 or more. Default 0: sqrt(d / i), or p / i without d."
    )
    error_deadband: Annotated[JointValue, Field(ge=0)] = Field(
        0.0, description="Errors up to this size are not integrated, 0 or more. Default 0."
    )
    ff_velocity_scale: float = Field(0.0, description="Feed-forward gain on the reference velocity. Default 0.")

    @model_validator(mode="after")
    def _bounds(self) -> GainsSpec:
        least, most = self.u_clamp_min, self.u_clamp_max
        if least is not None and most is not None and least >= most:
            raise ValueError(f"u_clamp_min {least:g} is not below u_clamp_max {most:g}")
        return self

    @property
    def idle(self) -> bool:
        """Whether these gains command nothing."""
        return self.p == self.i == self.d == self.ff_velocity_scale == 0.0

    @property
    def integral_bounds(self) -> tuple[float, float]:
        """Smallest and largest effort of the integral term."""
        clamp = math.inf if self.i_clamp is None else self.i_clamp
        least, most = self.i_clamp_min, self.i_clamp_max
        return -clamp if least is None else least, clamp if most is None else most


class JointConstraintSpec(Model):
    """Tolerances of one joint, rad or m; a missing one is not enforced."""

    trajectory: JointTolerance | None = Field(
        None, description="Path tolerance [rad or m], above 0 to pi. Default: not enforced."
    )
    goal: JointTolerance | None = Field(
        None, description="Goal tolerance [rad or m], above 0 to pi. Default: not enforced."
    )
    max_deceleration_on_cancel: Annotated[JointAcceleration, Field(ge=0)] = Field(
        0.0, description="Deceleration after a cancel [rad/s^2 or m/s^2], 0 or more. Default 0: the acceleration limit."
    )


class ConstraintsSpec(Model):
    """Tolerances by which a trajectory succeeds or fails. `goal_time`: extra time after its end."""

    goal_time: Annotated[
        Time,
        Field(
            ge=0,
            description="Extra time to reach the goal after the trajectory's end, 0 or more. 0: no extra time; with "
            "`compat: ros2`, no time limit. Default 2 s.",
        ),
    ] = 2.0
    stopped_velocity_tolerance: Annotated[
        JointVelocity,
        Field(ge=0, description="Largest velocity error at the goal, 0 or more; 0: not enforced. Default 0.05 rad/s."),
    ] = 0.05
    decelerate_on_cancel: bool = Field(
        True,
        description="Whether a cancel decelerates, within position limits, and without `compat` an abort; within the "
        "limits of acceleration and jerk, with `compat` at constant deceleration. If false, the reference stops at "
        "once. Default true.",
    )
    joints: dict[str, JointConstraintSpec] = Field({}, description="Tolerances by joint.")
