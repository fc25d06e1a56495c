"""What users write of controllers: what all have, and those of joint trajectories and of grippers."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import Force, Frequency, JointEffort, JointValue, JointVelocity, Time

Interface = Literal["position", "velocity", "acceleration", "effort"]
Role = Literal["follower", "hand", "other"]
"""What steps may ask of a controller: to follow trajectories, to close and open a hand, or nothing."""


class ControllerSpec(Model):
    """What every controller has."""

    role: ClassVar[Role] = "other"

    type: str
    joints: tuple[str, ...] = Field((), description="The joints that it claims or reads.")
    active: bool = Field(True, description="Whether it is active at the start. Default true.")
    update_rate: Annotated[Frequency, Field(gt=0)] | None = Field(
        None, description="How often it is updated [Hz]; divides the control rate. Default: at every control tick."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return ()


class GainsSpec(Model):
    """PID gains of one joint. Units follow the command interface (effort: N m/rad, N m s/rad, N m/(rad s))."""

    p: Annotated[float, Field(ge=0, description="Proportional, 0 or more. Default 0.")] = 0.0
    i: Annotated[float, Field(ge=0, description="Integral, 0 or more. Default 0.")] = 0.0
    d: Annotated[float, Field(ge=0, description="Derivative, 0 or more. Default 0.")] = 0.0
    i_clamp: Annotated[float, Field(ge=0)] | None = Field(
        None, description="Greatest effort of the integral term, 0 or more. Default: unlimited."
    )
    ff_velocity_scale: float = Field(0.0, description="Factor on the reference velocity, added. Default 0.")


class JointConstraintSpec(Model):
    """Tolerances of one joint, rad or m; absent means not enforced."""

    trajectory: Annotated[JointValue, Field(gt=0)] | None = Field(None, description="On the way [rad or m], above 0.")
    goal: Annotated[JointValue, Field(gt=0)] | None = Field(None, description="At the end [rad or m], above 0.")


class ConstraintsSpec(Model):
    """When a trajectory counts as failed or reached. `goal_time`: grace after its end."""

    goal_time: Annotated[
        Time, Field(ge=0, description="Time to reach the goal after the trajectory's end, 0 or more. Default 2 s.")
    ] = 2.0
    stopped_velocity_tolerance: Annotated[
        JointVelocity, Field(ge=0, description="Greatest velocity at the goal, 0 or more. Default 0.05 rad/s.")
    ] = 0.05
    joints: dict[str, JointConstraintSpec] = Field({}, description="Tolerances by joint.")


class JointTrajectorySpec(ControllerSpec):
    """Follows joint trajectories: PID with feed-forward (effort, velocity), or passes the reference on (position)."""

    role: ClassVar[Role] = "follower"

    type: Literal["joint_trajectory"] = Field(description="`joint_trajectory`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["position", "velocity", "effort"] = Field(
        "effort", description="What it commands. Default effort."
    )
    gains: dict[str, GainsSpec] = Field({}, description="PID gains by joint.")
    gravity_compensation: bool = Field(False, description="Add the effort that holds against gravity. Default false.")
    inverse_dynamics: bool = Field(False, description="Add the effort that the reference needs. Default false.")
    constraints: ConstraintsSpec = Field(ConstraintsSpec(), description="Tolerances and goal time.")

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)


class GripperSpec(ControllerSpec):
    """Closes or opens a hand: each joint's reference moves at `speed`; a finger stops on contact or stall."""

    role: ClassVar[Role] = "hand"

    type: Literal["gripper"] = Field(description="`gripper`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["effort"] = Field("effort", description="What it commands: effort.")
    gains: dict[str, GainsSpec] = Field({}, description="PID gains by joint.")
    gravity_compensation: bool = Field(True, description="Add the effort that holds against gravity. Default true.")
    speed: Annotated[JointVelocity, Field(gt=0, description="Of the reference, above 0. Default 1 rad/s or m/s.")] = 1.0
    max_effort: Annotated[JointEffort, Field(gt=0)] | None = Field(
        None, description="Greatest effort a joint [N m or N], above 0. Default: the joint's limit."
    )
    stall_velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Slower counts as stalled, above 0. Default 0.02 rad/s or 1 mm/s."
    )
    stall_time: Annotated[Time, Field(gt=0, description="Stalled so long is stopped, above 0. Default 0.2 s.")] = 0.2
    goal_tolerance: Annotated[JointValue, Field(gt=0)] | None = Field(
        None, description="Distance that counts as arrived, above 0. Default 0.05 rad or 2 mm."
    )
    default_force: Annotated[Force, Field(gt=0, description="Of a finger where no step says one. Default 5 N.")] = 5.0

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)
