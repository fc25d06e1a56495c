"""`joint_trajectory`: controller that follows joint trajectories on position, velocity or effort interfaces.

    controllers:
      arm_controller:
        type: joint_trajectory
        joints: [joint_1, joint_2]
        command_interfaces: [effort]
        gains: {joint_1: {p: 800, d: 50}, joint_2: {p: 400, d: 25}}
        gravity_compensation: true
        constraints: {goal_time: 2 s, joints: {joint_1: {trajectory: 0.1, goal: 0.02}}}

With the reference q, v, a at t, at t + period marked by ', and the effort tau of the goal's points:

    [effort]              u = PID(e, de/dt) + ff_velocity_scale v' + tau'
    [velocity]            u = PID(e, de/dt) + ff_velocity_scale v'
    [position], [position, velocity], [position, velocity, acceleration]: q', v', a'
    [position, effort]    q', tau'

The error, and so every tolerance, is reference(t) - measured(t); the feed-forward is one period ahead, because the
joint executes it by the time the next tick measures it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, NoLoop, PidLoop
from manipcli.control.controller import BuildContext, ControllerMember, FeedForward
from manipcli.control.gains import idle_gains, strangers
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.control.trajectory_goal import controlled_by_error, refused
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.controllers import ChainableSpec, ConstraintsSpec, GainsSpec, Interface, Role
from manipcli.spec.quantity import Time

__all__ = ["MEMBER", "JointTrajectoryController"]


class SpeedScalingSpec(Model):
    """Speed of the clock of trajectories."""

    initial_scaling_factor: Annotated[float, Field(ge=0)] = Field(
        1.0, description="Trajectory seconds per second, 0 or more: 0 pauses. Default 1."
    )


class UpsamplingSpec(Model):
    """Velocities for goals with only positions."""

    enable: bool = Field(False, description="Follow the cubic spline through the positions. Default false.")


class JointTrajectorySpec(ChainableSpec):
    """Follows joint trajectories: PID with feed-forward (effort, velocity), or forwards the reference (position)."""

    role: ClassVar[Role] = "follower"

    type: Literal["joint_trajectory"] = Field(description="`joint_trajectory`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interfaces: tuple[Interface, ...] = Field(
        (),
        description="What it commands: [position], [position, velocity], [position, velocity, acceleration], "
        "[velocity], [effort] or [position, effort]. Default [effort].",
    )
    command_interface: Interface | None = Field(None, description="Short for a list with one interface.")
    state_interfaces: tuple[str, ...] = Field(
        ("position", "velocity"),
        description="Measured values: position, also velocity, also acceleration. Default [position, velocity].",
    )
    gains: dict[str, GainsSpec] = Field({}, description="PID gains by joint.")
    gravity_compensation: bool = Field(False, description="Add the effort that compensates gravity. Default false.")
    inverse_dynamics: bool = Field(False, description="Add the effort that the reference needs. Default false.")
    constraints: ConstraintsSpec = Field(ConstraintsSpec(), description="Tolerances and goal time.")
    allow_partial_joints_goal: bool = Field(False, description="Goals may omit joints. Default false.")
    allow_nonzero_velocity_at_trajectory_end: bool = Field(
        False, description="Goals may end in motion; the last position is then held. Default false."
    )
    allow_integration_in_goal_trajectories: bool = Field(
        False, description="Goals may give velocities or accelerations without positions. Default false."
    )
    allow_trajectory_replacement: bool = Field(
        True, description="A new goal continues from the old trajectory; otherwise that ends at once. Default true."
    )
    interpolation_method: Literal["splines", "none"] = Field(
        "splines", description="Between points: `splines`, or `none` to step to the next point. Default splines."
    )
    interpolate_from_desired_state: bool = Field(
        True, description="Goals start from the reference; otherwise from the measured state. Default true."
    )
    cmd_timeout: Annotated[Time, Field(ge=0)] = Field(
        0.0, description="Time after the end of a trajectory to abort an unreached goal; above goal_time, or 0: "
        "never. Default 0."
    )  # fmt: skip
    stop_trajectory_duration: Annotated[Time, Field(ge=0)] = Field(
        0.0, description="Duration of the stop after a cancel; 0: by deceleration. Default 0."
    )
    speed_scaling: SpeedScalingSpec = Field(SpeedScalingSpec(), description="Initial speed of trajectories.")
    positions_upsampling: UpsamplingSpec = Field(UpsamplingSpec(), description="For goals with only positions.")

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        if self.command_interfaces:
            return self.command_interfaces
        return ("effort",) if self.command_interface is None else (self.command_interface,)


def build(name: str, spec: JointTrajectorySpec, context: BuildContext) -> JointTrajectoryController:
    """The controller of a spec."""
    joints = [context.robot.joint(joint) for joint in spec.joints]
    wants: FeedForward = "gravity" if spec.gravity_compensation else "none"
    return JointTrajectoryController(
        name=name,
        joints=spec.joints,
        command_interfaces=spec.interfaces,
        state_interfaces=spec.state_interfaces,
        gains=spec.gains,
        constraints=spec.constraints,
        limits=[joint.limits for joint in joints],
        types=[joint.type for joint in joints],
        feed_forward="inverse_dynamics" if spec.inverse_dynamics else wants,
        chained_to=spec.chained_to,
        compat=context.compat,
        allow_partial_joints_goal=spec.allow_partial_joints_goal,
        allow_nonzero_velocity_at_trajectory_end=spec.allow_nonzero_velocity_at_trajectory_end,
        allow_integration_in_goal_trajectories=spec.allow_integration_in_goal_trajectories,
        allow_trajectory_replacement=spec.allow_trajectory_replacement,
        interpolation_method=spec.interpolation_method,
        interpolate_from_desired_state=spec.interpolate_from_desired_state,
        cmd_timeout=spec.cmd_timeout,
        stop_trajectory_duration=spec.stop_trajectory_duration,
        speed_scaling=spec.speed_scaling.initial_scaling_factor,
        positions_upsampling=spec.positions_upsampling.enable,
        stop_planner=context.stop_planner,
    )


def check(spec: JointTrajectorySpec, robot: RobotModel) -> Iterator[Problem]:
    """Incompatible interfaces; gains and tolerances of other joints, gains all zero; a feed-forward effort without an
    effort command."""
    yield from strangers(robot, spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    yield from strangers(
        robot, spec.joints, spec.constraints.joints, ("constraints", "joints"), "tolerances", "CTRL104"
    )
    key = "command_interfaces" if spec.command_interfaces else "command_interface"
    if spec.command_interface is not None and spec.command_interfaces:
        yield Problem((key,), "command_interface and command_interfaces are both set", "keep the list", "CTRL107")
    wrong = refused(spec.interfaces, spec.state_interfaces)
    if wrong is not None:
        where = key if wrong[0].startswith(("command", "unknown command")) else "state_interfaces"
        yield Problem((where,), wrong[0], wrong[1], "CTRL107")
        return
    if controlled_by_error(spec.interfaces):
        yield from idle_gains(robot, spec.joints, spec.gains, spec.interfaces[0])
    if "effort" not in spec.interfaces:
        for word in ("gravity_compensation", "inverse_dynamics"):
            if getattr(spec, word):
                message = f"{word} needs the effort interface, not {', '.join(spec.interfaces)}"
                yield Problem((word,), message, f"use command_interface: effort, or remove {word}", "CTRL147")


def loop(spec: JointTrajectorySpec) -> ControlLoop:
    """A PID loop on efforts or on velocities; positions are followed by the engine's motors."""
    if spec.chained_to is not None:
        return NoLoop(f"it commands the references of '{spec.chained_to}'")
    if not controlled_by_error(spec.interfaces):
        return NoLoop(f"its interface is {', '.join(spec.interfaces)}, which needs no gains")
    tolerances = {
        joint: tolerance
        for joint, own in spec.constraints.joints.items()
        if (tolerance := own.goal if own.goal is not None else own.trajectory) is not None
    }
    return PidLoop(spec.gains, spec.gravity_compensation or spec.inverse_dynamics, tolerances)


MEMBER = ControllerMember(name="joint_trajectory", spec=JointTrajectorySpec, build=build, check=check, loop=loop)
