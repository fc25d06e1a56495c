"""`gripper`: controller of a hand; each finger's reference moves until contact, stall, or its target.

    controllers:
      hand_controller:
        type: gripper
        joints: [finger_1_proximal, finger_1_distal]
        gains: {finger_1_proximal: {p: 3, d: 0.03}, finger_1_distal: {p: 2, d: 0.015}}
        speed: 1 rad/s
        max_effort: 2
        allow_stalling: true

Effort: u = PID(e, de/dt), clamped to the maximum effort; gravity compensation is added. When a finger stops, its
reference stays: the gains keep pressing with the effort built up so far, and the integral of a finger with the
requested force is frozen. Position: u = the reference; the effort limits of the joints determine how hard it presses.

Goals, results and parameters are those of ROS's GripperCommand: a position for all joints or one per joint,
`max_effort`, `stalled`, `reached_goal`, `allow_stalling`. A finger that stalls against an object has grasped it, so
stalling is allowed by default (in ROS it is not).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.action import GripperGoal
from manipcli.control.control_loop import ControlLoop, HandSettings, NoLoop, PidLoop
from manipcli.control.controller import BuildContext, ControllerMember
from manipcli.control.gains import idle_gains, strangers
from manipcli.control.gripper_controller import GripperController
from manipcli.core.geometry import Array
from manipcli.description.elements import Joint
from manipcli.model.robot import RobotModel
from manipcli.plan.hand import closing_speed, fingers
from manipcli.spec.controllers import ControllerSpec, GainsSpec, Interface, Role
from manipcli.spec.quantity import JointEffort, JointTolerance, JointVelocity, Time

__all__ = ["MEMBER", "GripperController", "GripperGoal"]

STALL_VELOCITY: Final = 0.02
STALL_SPEED: Final = 0.001
"""Default speed below which a finger joint is stalled [rad/s; m/s]."""
GOAL_ANGLE: Final = 0.05
GOAL_DISTANCE: Final = 0.002
"""Default tolerance of a finger joint's target [rad; m]: far less than a hand's stroke."""


class GripperSpec(ControllerSpec):
    """Closes or opens a hand: each joint's reference moves at `speed`; a finger stops on contact or stall."""

    role: ClassVar[Role] = "hand"

    type: Literal["gripper"] = Field(description="`gripper`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["position", "effort"] = Field("effort", description="What it commands. Default effort.")
    gains: dict[str, GainsSpec] = Field({}, description="PID gains by joint.")
    gravity_compensation: bool = Field(True, description="Add the effort that compensates gravity. Default true.")
    speed: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Of the reference, above 0. Default 1 rad/s or m/s, at most the least limit of its joints."
    )
    max_effort: Annotated[JointEffort, Field(gt=0)] | None = Field(
        None, description="Largest effort per joint [N m or N], above 0. Default: the joint's limit."
    )
    stall_velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="A slower joint counts as stalled, above 0. Default 0.02 rad/s or 1 mm/s."
    )
    stall_time: Annotated[
        Time, Field(gt=0, description="Time stalled before the finger stops, above 0. Default 0.2 s.")
    ] = 0.2
    allow_stalling: bool = Field(
        True, description="A stalled finger counts as a grasp; otherwise its goal is aborted. Default true."
    )
    goal_tolerance: JointTolerance | None = Field(
        None, description="Tolerance of the target, above 0 to pi. Default 0.05 rad or 2 mm."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)


def build(name: str, spec: GripperSpec, context: BuildContext) -> GripperController:
    """The controller of a spec."""
    joints = [context.robot.joint(joint) for joint in spec.joints]
    own = math.inf if spec.max_effort is None else spec.max_effort
    effort = np.array([min(own, math.inf if j.limits.effort is None else j.limits.effort) for j in joints])
    return GripperController(
        name=name,
        joints=spec.joints,
        gains=spec.gains,
        interface=spec.command_interface,
        types=[joint.type for joint in joints],
        fingers=fingers(context.robot, spec.joints),
        speed=closing_speed(context.robot, spec.joints, spec.speed),
        max_effort=effort if spec.command_interface == "effort" else None,
        stall_velocity=_each(joints, spec.stall_velocity, turning=STALL_VELOCITY, sliding=STALL_SPEED),
        stall_time=spec.stall_time,
        allow_stalling=spec.allow_stalling,
        goal_tolerance=_each(joints, spec.goal_tolerance, turning=GOAL_ANGLE, sliding=GOAL_DISTANCE),
        feed_forward="gravity" if spec.gravity_compensation and spec.command_interface == "effort" else "none",
        compat=context.compat,
    )


def _each(joints: Sequence[Joint], stated: float | None, *, turning: float, sliding: float) -> Array:
    """(n) the stated value, or the default of each joint's type."""
    defaults = [sliding if joint.type == "prismatic" else turning for joint in joints]
    return np.array(defaults if stated is None else [stated] * len(joints))


def check(spec: GripperSpec, robot: RobotModel) -> Iterator[Problem]:
    """Gains of other joints, gains all zero; a maximum effort on the position interface."""
    yield from strangers(robot, spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    if spec.command_interface == "effort":
        yield from idle_gains(robot, spec.joints, spec.gains, "effort")
    elif spec.max_effort is not None:
        hint = "use command_interface: effort, or set the effort limits of the joints"
        yield Problem(("max_effort",), "max_effort needs the effort interface, not position", hint, "CTRL147")


def loop(spec: GripperSpec) -> ControlLoop:
    """A PID loop on efforts; positions are followed by the engine's motors."""
    if spec.command_interface == "position":
        return NoLoop("its interface is position, which needs no gains")
    return PidLoop(spec.gains, spec.gravity_compensation)


def hand(spec: GripperSpec) -> HandSettings:
    """Its speed and its effort, as in the file."""
    return HandSettings(spec.command_interface, spec.speed, spec.max_effort)


MEMBER = ControllerMember(name="gripper", spec=GripperSpec, build=build, check=check, loop=loop, hand=hand)
