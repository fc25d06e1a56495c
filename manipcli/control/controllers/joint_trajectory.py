"""Follows joint trajectories on position, velocity and effort interfaces, with tolerances that name what broke them.

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

The error, and so every tolerance, is reference(t) - measured(t); what is fed forward looks one period ahead, because it
is what the joint shall have when the next tick measures it.
"""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.control.controller import ControllerMember, FeedForward, Fit
from manipcli.control.gains import idle_gains, strangers
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.control.trajectory_goal import controlled_by_error, refused
from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import JointTrajectorySpec

__all__ = ["MEMBER", "JointTrajectoryController"]


def build(name: str, spec: JointTrajectorySpec, fit: Fit) -> JointTrajectoryController:
    """The controller of a spec."""
    joints = [fit.robot.joint(joint) for joint in spec.joints]
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
        compat=fit.compat,
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
    )


def check(spec: JointTrajectorySpec, robot: RobotModel) -> Iterator[Problem]:
    """Interfaces that do not go together; gains and tolerances of joints that it does not have, gains all zero; an
    effort added where none is commanded."""
    yield from strangers(robot, spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    yield from strangers(
        robot, spec.joints, spec.constraints.joints, ("constraints", "joints"), "tolerances", "CTRL104"
    )
    key = "command_interfaces" if spec.command_interfaces else "command_interface"
    if spec.command_interface is not None and spec.command_interfaces:
        yield Problem((key,), "command_interface and command_interfaces say the same", "keep the list", "CTRL107")
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
                message = f"{word} adds an effort, but its interface is {', '.join(spec.interfaces)}"
                yield Problem((word,), message, "use command_interface: effort, or leave it out", "CTRL147")


MEMBER = ControllerMember(name="joint_trajectory", spec=JointTrajectorySpec, build=build, check=check)
