"""From the controllers file to controllers that fit a robot: every finding of the file at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Final

import numpy as np

from manipcli.control.controller import Controller, FeedForward
from manipcli.control.gripper import GripperController
from manipcli.control.joint_trajectory_controller import JointTrajectoryController
from manipcli.control.manager import ControllerManager
from manipcli.control.pid import Compat
from manipcli.core.errors import Finding, InvalidInput, Place
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.model.robot import Joint, RobotModel
from manipcli.plan.hand import fingers
from manipcli.spec.controllers import ControllerSpec, ControllersSpec, GripperSpec, JointTrajectorySpec

STALL_VELOCITY: Final = 0.02
STALL_SPEED: Final = 0.001
"""A finger joint slower than this is stalled, where nobody says [rad/s; m/s]."""
GOAL_ANGLE: Final = 0.05
GOAL_DISTANCE: Final = 0.002
"""A finger joint this near to its target has arrived, where nobody says [rad; m]: far less than a hand's stroke."""

Where = Callable[[tuple[str | int, ...]], Place | None]
"""The place in the file of a value, by its keys from the top: ("controllers", "arm", "joints", 0)."""


def _nowhere(_: tuple[str | int, ...]) -> None:
    return None


def build_controllers(
    spec: ControllersSpec,
    robot: RobotModel,
    period: float,
    place: Where = _nowhere,
    *,
    compat: Compat = "ros2",
) -> ControllerManager:
    """The controllers of a file, for a robot, updated every `period` [s].

    Raises:
        InvalidInput: all findings at once: unknown, fixed, mimic, repeated or unclaimed joints; a joint claimed twice;
            gains or tolerances of joints that a controller does not have; gains all zero; feed-forward on an interface
            that has no effort.
    """
    findings = list(_findings(spec, robot, place))
    if findings:
        raise InvalidInput(findings)
    return ControllerManager(
        [_build(name, one, robot, compat) for name, one in spec.controllers.items()],
        joints=robot.joint_names,
        period=period,
        following=[joint.name for joint in robot.moving_joints if joint.mimic is not None],
    )


def _build(name: str, spec: ControllerSpec, robot: RobotModel, compat: Compat) -> Controller:
    joints = [robot.joint(joint) for joint in spec.joints]
    wants: FeedForward = "gravity" if spec.gravity_compensation else "none"
    if isinstance(spec, JointTrajectorySpec):
        return JointTrajectoryController(
            name=name,
            joints=spec.joints,
            interface=spec.command_interface,
            gains=spec.gains,
            constraints=spec.constraints,
            limits=[joint.limits for joint in joints],
            types=[joint.type for joint in joints],
            feed_forward="inverse_dynamics" if spec.inverse_dynamics else wants,
            compat=compat,
        )
    own = math.inf if spec.max_effort is None else spec.max_effort
    return GripperController(
        name=name,
        joints=spec.joints,
        gains=spec.gains,
        fingers=fingers(robot, spec.joints),
        speed=spec.speed,
        max_effort=np.array([min(own, math.inf if j.limits.effort is None else j.limits.effort) for j in joints]),
        stall_velocity=_each(joints, spec.stall_velocity, turning=STALL_VELOCITY, sliding=STALL_SPEED),
        stall_time=spec.stall_time,
        goal_tolerance=_each(joints, spec.goal_tolerance, turning=GOAL_ANGLE, sliding=GOAL_DISTANCE),
        feed_forward=wants,
        compat=compat,
    )


def _each(joints: Sequence[Joint], stated: float | None, *, turning: float, sliding: float) -> Array:
    """(n) what was stated, or the default of each joint's type."""
    defaults = [sliding if joint.type == "prismatic" else turning for joint in joints]
    return np.array(defaults if stated is None else [stated] * len(joints))


def _findings(spec: ControllersSpec, robot: RobotModel, place: Where) -> Iterator[Finding]:
    owners: dict[str, str] = {}
    for name, one in spec.controllers.items():
        at = ("controllers", name)
        if not one.joints:
            yield Finding(code="CTRL101", message=f"controller '{name}' has no joints", place=place((*at, "joints")))
        for k, joint in enumerate(one.joints):
            yield from _joint_findings(name, joint, robot, place((*at, "joints", k)))
            if joint in owners:
                message = (
                    f"joint '{joint}' stands twice in controller '{name}'"
                    if owners[joint] == name
                    else f"controllers '{owners[joint]}' and '{name}' both claim joint '{joint}'"
                )
                yield Finding(code="CTRL142", message=message, place=place((*at, "joints", k)))
            owners.setdefault(joint, name)
        yield from _gain_findings(name, one, place)
        yield from _feed_forward_findings(name, one, place)
    idle = [joint.name for joint in robot.moving_joints if joint.independent and joint.name not in owners]
    if idle:
        yield Finding(
            code="CTRL145",
            message=f"no controller commands {', '.join(repr(joint) for joint in idle)} of robot '{robot.name}'",
            place=place(("controllers",)),
            hint=f"add {'it' if len(idle) == 1 else 'them'} to a controller: a joint that nobody commands falls",
        )


def _joint_findings(name: str, joint: str, robot: RobotModel, place: Place | None) -> Iterator[Finding]:
    known = {other.name: other for other in robot.joints}
    if joint not in known:
        commandable = [other.name for other in robot.joints if other.independent]
        yield Finding(
            code="CTRL144",
            message=f"controller '{name}': joint '{joint}' is not in robot '{robot.name}'",
            place=place,
            hint=did_you_mean(joint, commandable, kind="joints"),
        )
        return
    found = known[joint]
    if not found.moves:
        message = f"controller '{name}': joint '{joint}' is fixed; it cannot be commanded"
        yield Finding(code="CTRL146", message=message, place=place)
    elif found.mimic is not None:
        message = f"controller '{name}': joint '{joint}' mimics '{found.mimic.joint}'; it cannot be commanded"
        hint = f"claim '{found.mimic.joint}' instead"
        yield Finding(code="CTRL143", message=message, place=place, hint=hint)


def _other_owner(joint: str, joints: Collection[str], given: Collection[str], what: str) -> str:
    """Whose gains or tolerances those `given` to `joint` may be: only a joint that has none was meant."""
    without = [other for other in joints if other not in given]
    return did_you_mean(joint, without, kind=f"joints without {what}") or f"take them out, or add '{joint}' to `joints`"


def _gain_findings(name: str, spec: ControllerSpec, place: Where) -> Iterator[Finding]:
    at = ("controllers", name)
    for joint in spec.gains:
        if joint not in spec.joints:
            yield Finding(
                code="CTRL102",
                message=f"controller '{name}': '{joint}' has gains, but is not one of its joints",
                place=place((*at, "gains", joint)),
                hint=_other_owner(joint, spec.joints, spec.gains, "gains"),
            )
    tolerances = spec.constraints.joints if isinstance(spec, JointTrajectorySpec) else {}
    for joint in tolerances:
        if joint not in spec.joints:
            yield Finding(
                code="CTRL104",
                message=f"controller '{name}': '{joint}' has tolerances, but is not one of its joints",
                place=place((*at, "constraints", "joints", joint)),
                hint=_other_owner(joint, spec.joints, tolerances, "tolerances"),
            )
    if spec.command_interface == "position":
        return
    for joint in spec.joints:
        gains = spec.gains.get(joint)
        if gains is None or gains.p == gains.i == gains.d == gains.ff_velocity_scale == 0.0:
            where = ("gains", joint) if gains is not None else ("gains",) if spec.gains else ()
            yield Finding(
                code="CTRL103",
                message=f"controller '{name}': the gains of joint '{joint}' are all zero; "
                f"on the {spec.command_interface} interface it would not move",
                place=place((*at, *where)),
                hint=f"give gains.{joint}.p",
            )


def _feed_forward_findings(name: str, spec: ControllerSpec, place: Where) -> Iterator[Finding]:
    if isinstance(spec, GripperSpec) or spec.command_interface == "effort":
        return
    for key in ("gravity_compensation", "inverse_dynamics"):
        if getattr(spec, key):
            yield Finding(
                code="CTRL147",
                message=f"controller '{name}': {key} adds an effort, but its interface is {spec.command_interface}",
                place=place(("controllers", name, key)),
                hint="use command_interface: effort, or leave it out",
            )
