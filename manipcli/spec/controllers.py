"""What users write of controllers: what all have, and those of joint trajectories and of grippers."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import (
    Frequency,
    JointAcceleration,
    JointEffort,
    JointTolerance,
    JointValue,
    JointVelocity,
    Time,
)

Interface = Literal["position", "velocity", "acceleration", "effort"]
Role = Literal["follower", "hand", "other"]
"""What steps may ask of a controller: to follow trajectories, to close and open a hand, or nothing."""


class ControllerSpec(Model):
    """What every controller has."""

    role: ClassVar[Role] = "other"

    type: str = Field(description="By what law it moves them: one of the types.")
    joints: tuple[str, ...] = Field((), description="The joints that it claims or reads.")
    active: bool = Field(True, description="Whether it is active at the start. Default true.")
    update_rate: Annotated[Frequency, Field(gt=0)] | None = Field(
        None, description="How often it is updated [Hz]; divides the control rate. Default: at every control tick."
    )

    @model_validator(mode="after")
    def _each_joint_once(self) -> Self:
        for k, name in enumerate(self.joints):
            if name in self.joints[:k]:
                raise problem("duplicate", f"joint '{name}' stands twice", at=("joints", k))
        return self

    def ticks(self, period: float) -> int:
        """Control ticks of `period` [s] from one update to the next, for a rate that divides the control rate."""
        return 1 if self.update_rate is None else max(1, round(1.0 / (self.update_rate * period)))

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return ()


AntiWindup = Literal["none", "back_calculation", "conditional_integration"]


MOST_GAIN: Final = 1e12
"""No joint is as stiff; beyond 1e300 products of gains are no numbers any more."""


class GainsSpec(Model):
    """PID gains of one joint. Units follow the command interface (effort: N m/rad, N m s/rad, N m/(rad s))."""

    p: Annotated[float, Field(ge=0, le=MOST_GAIN, description="Proportional, 0 or more. Default 0.")] = 0.0
    i: Annotated[float, Field(ge=0, le=MOST_GAIN, description="Integral, 0 or more. Default 0.")] = 0.0
    d: Annotated[float, Field(ge=0, le=MOST_GAIN, description="Derivative, 0 or more. Default 0.")] = 0.0
    i_clamp: Annotated[float, Field(ge=0)] | None = Field(
        None, description="Greatest effort of the integral term, 0 or more. Default: unlimited."
    )
    i_clamp_min: Annotated[float, Field(le=0)] | None = Field(
        None, description="Least effort of the integral term, 0 or less. Default: -i_clamp."
    )
    i_clamp_max: Annotated[float, Field(ge=0)] | None = Field(
        None, description="Greatest effort of the integral term, 0 or more. Default: i_clamp."
    )
    u_clamp_min: float | None = Field(None, description="Least command. Default: unlimited.")
    u_clamp_max: float | None = Field(None, description="Greatest command, above u_clamp_min. Default: unlimited.")
    antiwindup_strategy: AntiWindup = Field(
        "none",
        description="What the integral does while the command is clamped: `none`, `back_calculation` or "
        "`conditional_integration`. Default none.",
    )
    antiwindup: bool = Field(
        False,
        description="As in ROS 1, where `compat` is ros1: clamp the integral of the error itself, not only its term. "
        "By the other rules the integral is always clamped. Default false.",
    )
    tracking_time_constant: Annotated[Time, Field(ge=0)] = Field(
        0.0, description="Of back calculation, 0 or more. Default 0: sqrt(d / i), or p / i without d."
    )
    error_deadband: Annotated[JointValue, Field(ge=0)] = Field(
        0.0, description="Errors that are not larger are not integrated, 0 or more. Default 0."
    )
    ff_velocity_scale: float = Field(0.0, description="Factor on the reference velocity, added. Default 0.")

    @model_validator(mode="after")
    def _bounds(self) -> GainsSpec:
        least, most = self.u_clamp_min, self.u_clamp_max
        if least is not None and most is not None and least >= most:
            raise ValueError(f"u_clamp_min {least:g} is not below u_clamp_max {most:g}")
        return self

    @property
    def idle(self) -> bool:
        """Whether nothing would ever be commanded by these."""
        return self.p == self.i == self.d == self.ff_velocity_scale == 0.0

    @property
    def integral_bounds(self) -> tuple[float, float]:
        """The least and the greatest effort of the integral term."""
        clamp = math.inf if self.i_clamp is None else self.i_clamp
        least, most = self.i_clamp_min, self.i_clamp_max
        return -clamp if least is None else least, clamp if most is None else most


class JointConstraintSpec(Model):
    """Tolerances of one joint, rad or m; absent means not enforced."""

    trajectory: JointTolerance | None = Field(
        None, description="On the way [rad or m], above 0 to pi. Left out: not enforced."
    )
    goal: JointTolerance | None = Field(
        None, description="At the end [rad or m], above 0 to pi. Left out: not enforced."
    )
    max_deceleration_on_cancel: Annotated[JointAcceleration, Field(ge=0)] = Field(
        0.0, description="After a cancel [rad/s^2 or m/s^2], 0 or more. Default 0: the joint's acceleration limit."
    )


class ConstraintsSpec(Model):
    """When a trajectory counts as failed or reached. `goal_time`: grace after its end."""

    goal_time: Annotated[
        Time,
        Field(
            ge=0,
            description="Time to reach the goal after the trajectory's end, 0 or more; 0 is no grace, but without end "
            "where `compat` is ros2. Default 2 s.",
        ),
    ] = 2.0
    stopped_velocity_tolerance: Annotated[
        JointVelocity,
        Field(ge=0, description="Greatest velocity error at the goal, 0 or more; 0: any. Default 0.05 rad/s."),
    ] = 0.05
    decelerate_on_cancel: bool = Field(
        True,
        description="After a cancel slow down, within position limits; else stop at once where the reference is. "
        "Default true.",
    )
    joints: dict[str, JointConstraintSpec] = Field({}, description="Tolerances by joint.")


class SpeedScalingSpec(Model):
    """How fast the clock of trajectories runs."""

    initial_scaling_factor: Annotated[float, Field(ge=0)] = Field(
        1.0, description="Seconds of the trajectory a second, 0 or more: 0 pauses. Default 1."
    )


class UpsamplingSpec(Model):
    """Velocities for goals that give positions alone."""

    enable: bool = Field(False, description="Follow the cubic spline through the positions. Default false.")


class JointTrajectorySpec(ControllerSpec):
    """Follows joint trajectories: PID with feed-forward (effort, velocity), or passes the reference on (position)."""

    role: ClassVar[Role] = "follower"

    type: Literal["joint_trajectory"] = Field(description="`joint_trajectory`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interfaces: tuple[Interface, ...] = Field(
        (),
        description="What it commands: [position], [position, velocity], [position, velocity, acceleration], "
        "[velocity], [effort] or [position, effort]. Default [effort].",
    )
    command_interface: Interface | None = Field(None, description="Short for a list of one of them.")
    state_interfaces: tuple[str, ...] = Field(
        ("position", "velocity"),
        description="What it may read: position, also velocity, also acceleration. Default [position, velocity].",
    )
    gains: dict[str, GainsSpec] = Field({}, description="PID gains by joint.")
    gravity_compensation: bool = Field(False, description="Add the effort that holds against gravity. Default false.")
    inverse_dynamics: bool = Field(False, description="Add the effort that the reference needs. Default false.")
    constraints: ConstraintsSpec = Field(ConstraintsSpec(), description="Tolerances and goal time.")
    allow_partial_joints_goal: bool = Field(False, description="Goals may leave joints out. Default false.")
    allow_nonzero_velocity_at_trajectory_end: bool = Field(
        False, description="Goals may end in motion; the last position is held then. Default false."
    )
    allow_integration_in_goal_trajectories: bool = Field(
        False, description="Goals may give velocities or accelerations without positions. Default false."
    )
    allow_trajectory_replacement: bool = Field(
        True, description="A new goal goes on from the old path; else the old one ends at once. Default true."
    )
    interpolation_method: Literal["splines", "none"] = Field(
        "splines", description="Between points: `splines`, or `none` to step to the next point. Default splines."
    )
    interpolate_from_desired_state: bool = Field(
        True, description="Goals start from the reference; else from what is measured. Default true."
    )
    cmd_timeout: Annotated[Time, Field(ge=0)] = Field(
        0.0, description="After the end of a trajectory a goal that is not reached is given up; above goal_time, or 0: "
        "never. Default 0."
    )  # fmt: skip
    stop_trajectory_duration: Annotated[Time, Field(ge=0)] = Field(
        0.0, description="After a cancel stop in this time, instead of by deceleration. Default 0: not."
    )
    speed_scaling: SpeedScalingSpec = Field(SpeedScalingSpec(), description="How fast trajectories run at first.")
    positions_upsampling: UpsamplingSpec = Field(UpsamplingSpec(), description="For goals of positions alone.")

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        if self.command_interfaces:
            return self.command_interfaces
        return ("effort",) if self.command_interface is None else (self.command_interface,)


class GripperSpec(ControllerSpec):
    """Closes or opens a hand: each joint's reference moves at `speed`; a finger stops on contact or stall."""

    role: ClassVar[Role] = "hand"

    type: Literal["gripper"] = Field(description="`gripper`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["position", "effort"] = Field("effort", description="What it commands. Default effort.")
    gains: dict[str, GainsSpec] = Field({}, description="PID gains by joint.")
    gravity_compensation: bool = Field(True, description="Add the effort that holds against gravity. Default true.")
    speed: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Of the reference, above 0. Default 1 rad/s or m/s, or the least limit of its joints."
    )
    max_effort: Annotated[JointEffort, Field(gt=0)] | None = Field(
        None, description="Greatest effort a joint [N m or N], above 0. Default: the joint's limit."
    )
    stall_velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Slower counts as stalled, above 0. Default 0.02 rad/s or 1 mm/s."
    )
    stall_time: Annotated[Time, Field(gt=0, description="Stalled so long is stopped, above 0. Default 0.2 s.")] = 0.2
    allow_stalling: bool = Field(
        True, description="Whether a stalled finger has grasped; otherwise its goal is aborted. Default true."
    )
    goal_tolerance: JointTolerance | None = Field(
        None, description="Distance that counts as arrived, above 0 to pi. Default 0.05 rad or 2 mm."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)
