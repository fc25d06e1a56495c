"""The controllers file. One entry a controller; the key `type` says which (the short name, or ROS's long one)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import Force, JointEffort, JointValue, JointVelocity, Time

Interface = Literal["position", "velocity", "effort"]


class GainsSpec(Model):
    """PID gains of one joint. Units follow the command interface (effort: N m/rad, N m s/rad, N m/(rad s))."""

    p: Annotated[float, Field(ge=0)] = 0.0
    i: Annotated[float, Field(ge=0)] = 0.0
    d: Annotated[float, Field(ge=0)] = 0.0
    i_clamp: Annotated[float, Field(ge=0)] | None = None
    ff_velocity_scale: float = 0.0


class JointConstraintSpec(Model):
    """Tolerances of one joint, rad or m; absent means not enforced."""

    trajectory: Annotated[JointValue, Field(gt=0)] | None = None
    goal: Annotated[JointValue, Field(gt=0)] | None = None


class ConstraintsSpec(Model):
    """When a trajectory counts as failed or reached. `goal_time`: grace after its end."""

    goal_time: Annotated[Time, Field(ge=0)] = 2.0
    stopped_velocity_tolerance: Annotated[JointVelocity, Field(ge=0)] = 0.05
    joints: dict[str, JointConstraintSpec] = {}


class JointTrajectorySpec(Model):
    """Follows joint trajectories: PID with feed-forward (effort, velocity), or passes the reference on (position)."""

    type: Literal["joint_trajectory"]
    joints: tuple[str, ...]
    command_interface: Interface = "effort"
    gains: dict[str, GainsSpec] = {}
    gravity_compensation: bool = False
    inverse_dynamics: bool = False
    constraints: ConstraintsSpec = ConstraintsSpec()


class GripperSpec(Model):
    """Closes or opens a hand: each joint's reference moves at `speed`; a finger stops on contact or stall."""

    type: Literal["gripper"]
    joints: tuple[str, ...]
    command_interface: Literal["effort"] = "effort"
    gains: dict[str, GainsSpec] = {}
    gravity_compensation: bool = True
    speed: Annotated[JointVelocity, Field(gt=0)] = 1.0
    max_effort: Annotated[JointEffort, Field(gt=0)] | None = None
    stall_velocity: Annotated[JointVelocity, Field(gt=0)] = 0.02
    stall_time: Annotated[Time, Field(gt=0)] = 0.2
    goal_tolerance: Annotated[JointValue, Field(gt=0)] = 0.05
    default_force: Annotated[Force, Field(gt=0)] = 5.0


ControllerSpec = Annotated[JointTrajectorySpec | GripperSpec, Field(discriminator="type")]


class ControllersSpec(Model):
    """The file as a whole, after ROS's own forms have been rewritten to this one."""

    controllers: dict[str, ControllerSpec]
