"""`limits`: joints keep their limits."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.model.condition import Condition, Gauge, Problem, Setting, World, unknown_group
from manipcli.model.moments import Moments
from manipcli.model.reading import Reading, least, reading
from manipcli.model.robot import Joint, RobotModel
from manipcli.spec.base import Model

Quantity = Literal["position", "velocity", "effort"]
ALL: tuple[Quantity, ...] = ("position", "velocity", "effort")
_UNITS = {
    "position": ("rad", "m"),
    "velocity": ("rad/s", "m/s"),
    "effort": ("N m", "N"),
}
"""Of a joint that turns, and of one that slides."""


class LimitsSpec(Model):
    """Measured positions, velocities and efforts stay inside the limits of the joints."""

    group: str | None = Field(default=None, description="Only this group's joints. Default: all that move.")
    of: tuple[Quantity, ...] = Field(
        default=ALL, min_length=1, description="Which limits. Default [position, velocity, effort]."
    )
    spare: Annotated[float, Field(ge=0, lt=1)] = Field(
        default=0.0, description="Share of each limit (of half of its range, for positions) to be left. Default 0."
    )


class _Bound:
    """One limit of one joint: |value - middle| is at most `half`."""

    def __init__(self, joint: Joint, column: int, what: Quantity, spare: float, lower: float, upper: float) -> None:
        self.joint, self.column, self.what = joint.name, column, what
        self.middle, self.half = (lower + upper) / 2.0, (upper - lower) / 2.0
        self.allowed = self.half * (1.0 - spare)
        self.unit = _UNITS[what][1 if joint.type == "prismatic" else 0]

    def reading(self, moments: Moments) -> Reading:
        states = moments.states
        every: Array = {"position": states.position, "velocity": states.velocity, "effort": states.effort}[self.what]
        values = every[:, self.column]

        def say(k: int) -> str:
            low, high = (readable(self.middle + sign * self.allowed, self.unit) for sign in (-1.0, 1.0))
            value = readable(float(values[k]), self.unit)
            return f"{self.what} of joint '{self.joint}' is {value}; allowed {low} to {high}"

        margins = self.allowed - np.abs(values - self.middle)
        return reading(margins, moments.times, unit=self.unit, scale=self.half or 1.0, say=say)


def gauge(spec: LimitsSpec, world: World) -> Gauge:
    """The least distance of a measured position, velocity or effort to its limit; joint and quantity that decide are
    those with the least share of their limit left.

    The unit is that of the quantity and of the joint that decide. A quantity without a limit does not count.
    """
    bounds = _bounds(spec, world.robot)

    def look(moments: Moments) -> Reading:
        return least([bound.reading(moments) for bound in bounds])

    return look


def _bounds(spec: LimitsSpec, robot: RobotModel) -> list[_Bound]:
    names = robot.joint_names if spec.group is None else robot.group(spec.group).joints
    found = []
    for name in names:
        joint = robot.joint(name)
        (column,) = robot.indices((name,))
        limits = joint.limits
        if "position" in spec.of and limits.lower is not None and limits.upper is not None:
            found.append(_Bound(joint, column, "position", spec.spare, limits.lower, limits.upper))
        if "velocity" in spec.of and limits.velocity is not None:
            found.append(_Bound(joint, column, "velocity", spec.spare, -limits.velocity, limits.velocity))
        if "effort" in spec.of and limits.effort is not None:
            found.append(_Bound(joint, column, "effort", spec.spare, -limits.effort, limits.effort))
    return found


def check(spec: LimitsSpec, setting: Setting) -> tuple[Problem, ...]:
    """The group exists, and one of its joints has a limit."""
    unknown = unknown_group(setting.robot, spec.group, ("group",))
    if not unknown and not _bounds(spec, setting.robot):
        return (Problem((), f"no joint has a limit of its {' or '.join(spec.of)}"),)
    return unknown


LIMITS = Condition(
    name="limits",
    spec=LimitsSpec,
    units=("rad", "m", "rad/s", "m/s", "N m", "N"),
    open=gauge,
    check=check,
    absent=lambda spec, world: None,
    scope="always",
    example="limits: {group: arm, of: [velocity, effort], spare: 10 %}",
)
