"""`tracking`: the joints of a group follow their references within a tolerance."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_group
from manipcli.conditions.robustness import Measured, Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, wrapped
from manipcli.core.prose import amount, listing, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import GroupName
from manipcli.spec.quantity import JointTolerance


class TrackingSpec(Model):
    """Every joint of the group is at most `within` from its controller's reference."""

    group: GroupName = Field(description="A group of the robot; each of its joints must have a controller.")
    within: JointTolerance = Field(description="Largest difference of a joint [rad or m], to pi.")


def monitor(spec: TrackingSpec, world: World) -> Monitor:
    """`within` minus the largest |reference - measured| of the joints [rad, or m if the worst joint is prismatic].

    The error of a continuous joint is wrapped to +-pi. Ticks at which a joint has no active controller are ignored.
    """
    robot = world.robot
    joints = robot.group(spec.group).joints
    columns = robot.indices(joints)
    endless = np.array([robot.joint(name).type == "continuous" for name in joints], dtype=bool)
    unit_of = [robot.joint(name).unit for name in joints]
    units = tuple(sorted(set(unit_of)))

    def look(window: StateWindow) -> Robustness:
        reference = _references(window, joints)
        error = reference - window.states.position[:, columns]
        error[:, endless] = wrapped(error[:, endless])
        error = np.abs(error)
        known = ~np.isnan(reference)
        worst = np.argmax(error, axis=1)
        margins = spec.within - error[np.arange(len(worst)), worst]

        def found(k: int) -> Measured:
            name, unit = joints[worst[k]], unit_of[worst[k]]
            off, within = readable(float(error[k, worst[k]]), unit), readable(spec.within, unit)
            text = f"joint '{name}' is {off} from its reference; within {within}"
            return Measured(float(margins[k]), unit, float(window.times[k]), text)

        idle = [f"no controller of joint '{name}' was active" for name, there in zip(joints, known.T, strict=True)
                if not there.all()]  # fmt: skip
        return Robustness(
            margins, margins / spec.within, units, np.asarray(known.all(axis=1)), "".join(idle[:1]), found
        )

    return look


def _references(window: StateWindow, joints: tuple[str, ...]) -> Array:
    """(T, k) the references of the joints, each from its active controller; NaN without one."""
    found = np.full((len(window.times), len(joints)), np.nan)
    for reference in window.references:
        for k, name in enumerate(joints):
            if name in reference.joints:
                position = reference.position[:, reference.joints.index(name)]
                found[:, k] = np.where(np.isnan(found[:, k]), position, found[:, k])
    return found


def check(spec: TrackingSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown or empty group."""
    unknown = unknown_group(context.robot, spec.group, ("group",))
    if not unknown and not context.robot.group(spec.group).joints:
        return (Problem(("group",), f"group '{spec.group}' has no joints"),)
    return unknown


def absent(spec: TrackingSpec, world: World) -> str | None:
    """Tracking is ideal by definition, or a joint has no recorded reference."""
    if not world.physics:
        return "the engine has no physics, so tracking is ideal"
    for name in world.robot.group(spec.group).joints:
        if name not in world.referenced:
            return world.unrecorded.get("references") or f"the recording has no reference of joint '{name}'"
    return None


def clause(spec: TrackingSpec, robot: RobotModel) -> str:
    units = sorted({robot.joint(name).unit for name in robot.group(spec.group).joints}, reverse=True)
    within = listing([amount(spec.within, unit) for unit in units], "or")
    return f"each joint of group {named(spec.group)} is within {within} of its controller's reference"


TRACKING = Condition(
    name="tracking",
    spec=TrackingSpec,
    units=("rad", "m"),
    open=monitor,
    check=check,
    absent=absent,
    scope="always",
    clause=clause,
    example="tracking: {group: arm, within: 0.05 rad}",
)
