"""`tracking`: the joints of a group follow their references."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.model.condition import Condition, Gauge, Problem, Setting, World, unknown_group
from manipcli.model.moments import Moments
from manipcli.model.reading import Reading, least, reading
from manipcli.spec.base import Model
from manipcli.spec.quantity import JointValue


class TrackingSpec(Model):
    """No joint of the group is further than `within` from its controller's reference."""

    group: str = Field(description="A group of the robot; each of its joints must have a controller.")
    within: Annotated[JointValue, Field(gt=0)] = Field(description="Largest difference of a joint [rad or m].")


def gauge(spec: TrackingSpec, world: World) -> Gauge:
    """`within` minus the largest |reference - measured| [rad, or m where the worst joint slides] of the joints.

    A joint without limits errs the short way round. While no controller of a joint is active, nothing is said.
    """
    robot = world.robot
    joints = robot.group(spec.group).joints
    columns = robot.indices(joints)
    endless = [robot.joint(name).type == "continuous" for name in joints]
    units = ["m" if robot.joint(name).type == "prismatic" else "rad" for name in joints]

    def look(moments: Moments) -> Reading:
        readings = []
        for name, column, turns, unit in zip(joints, columns, endless, units, strict=True):
            reference = _reference(moments, name)
            error = reference - moments.states.position[:, column]
            if turns:
                error = np.remainder(error + np.pi, 2.0 * np.pi) - np.pi
            readings.append(_one(spec, moments, name, np.abs(error), unit, reference))
        return least(readings)

    return look


def _one(spec: TrackingSpec, moments: Moments, name: str, error: Array, unit: str, reference: Array) -> Reading:
    def say(k: int) -> str:
        off = readable(float(error[k]), unit)
        return f"joint '{name}' is {off} from its reference; within {readable(spec.within, unit)}"

    return reading(
        spec.within - error,
        moments.times,
        unit=unit,
        scale=spec.within,
        say=say,
        applies=~np.isnan(reference),
        idle=f"no controller of joint '{name}' was active",
    )


def _reference(moments: Moments, joint: str) -> Array:
    """(T,) what the joint should follow: that of the controller that is active."""
    found = np.full(len(moments.times), np.nan)
    for one in moments.references:
        if joint in one.joints:
            position = one.position[:, one.joints.index(joint)]
            found = np.where(np.isnan(found), position, found)
    return found


def check(spec: TrackingSpec, setting: Setting) -> tuple[Problem, ...]:
    """The robot has the group, and the group has joints."""
    unknown = unknown_group(setting.robot, spec.group, ("group",))
    if not unknown and not setting.robot.group(spec.group).joints:
        return (Problem(("group",), f"group '{spec.group}' has no joints"),)
    return unknown


def absent(spec: TrackingSpec, world: World) -> str | None:
    """No reference of one of the joints is recorded."""
    for name in world.robot.group(spec.group).joints:
        if name not in world.referenced:
            return world.unrecorded.get("references") or f"the recording holds no reference of joint '{name}'"
    return None


TRACKING = Condition(
    name="tracking",
    spec=TrackingSpec,
    units=("rad", "m"),
    open=gauge,
    check=check,
    absent=absent,
    scope="always",
    example="tracking: {group: arm, within: 0.05 rad}",
)
