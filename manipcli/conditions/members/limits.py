"""`limits`: joints stay within their position, velocity and effort limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, effortless, unknown_group
from manipcli.conditions.robustness import Measured, Robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.prose import listing, named, share
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import GroupName
from manipcli.spec.quantity import Share

SLACK: Final = 1e-4
"""[rad or m] An engine detects a stop at the end of a step: up to 50 um beyond it at 5 cm/s and 1 ms."""
MOST_DIGITS: Final = 9
"""Largest number of digits for a value and its limit, to make them differ."""

Quantity = Literal["position", "velocity", "effort"]
ALL: tuple[Quantity, ...] = ("position", "velocity", "effort")
_UNITS = {
    "position": ("rad", "m"),
    "velocity": ("rad/s", "m/s"),
    "effort": ("N m", "N"),
}
"""Units of (revolute, prismatic) joints."""


class LimitsSpec(Model):
    """Measured positions, velocities and efforts stay inside the limits of the joints."""

    group: GroupName | None = Field(default=None, description="Only joints of this group. Default: all moving joints.")
    of: tuple[Quantity, ...] = Field(
        default=ALL, min_length=1, description="Which limits. Default [position, velocity, effort]."
    )
    spare: Annotated[Share, Field(ge=0, lt=1)] = Field(
        default=0.0, description="Share of each limit to keep free; for positions, of half the range. Default 0."
    )


@dataclass(frozen=True, slots=True)
class _Bound:
    """A limit of a joint: |value - middle| <= `half`; `column` in the stacked positions, velocities and efforts."""

    joint: str
    what: Quantity
    unit: str
    column: int
    middle: float
    half: float


def monitor(spec: LimitsSpec, world: World) -> Monitor:
    """The least distance of a measured position, velocity or effort to its limit, relative to the limit.

    The unit is that of the deciding quantity and joint. A quantity without a limit is not compared. A position up to
    0.1 mm or 1e-4 rad beyond its limit has a margin of 0: engines detect a stop only at the end of a step. An engine
    without physics has no efforts: use `of: [position, velocity]`.
    """
    bounds = _bounds(spec, world.robot)
    columns = [bound.column for bound in bounds]
    middle, half = np.array([bound.middle for bound in bounds]), np.array([bound.half for bound in bounds])
    allowed, scale = half * (1.0 - spec.spare), np.where(half > 0.0, half, 1.0)
    slack = np.array([SLACK if bound.what == "position" and not spec.spare else 0.0 for bound in bounds])
    units = tuple(sorted({bound.unit for bound in bounds}))

    def look(window: StateWindow) -> Robustness:
        states = window.states
        values = np.concatenate((states.position, states.velocity, states.effort), axis=1)[:, columns]
        margins = allowed - np.abs(values - middle)
        margins[(margins < 0.0) & (margins >= -slack)] = 0.0
        relative = margins / scale
        worst = np.argmin(margins if len(units) == 1 else relative, axis=1)
        ticks = np.arange(len(worst))

        def found(k: int) -> Measured:
            j = int(worst[k])
            bound = bounds[j]
            least, most = bound.middle - float(allowed[j]), bound.middle + float(allowed[j])
            value, low, high = _apart((float(values[k, j]), least, most), bound.unit)
            text = f"{bound.what} of joint '{bound.joint}' is {value}; allowed {low} to {high}"
            return Measured(float(margins[k, j]), bound.unit, float(window.times[k]), text)

        everywhere = np.ones(len(ticks), dtype=bool)
        return Robustness(margins[ticks, worst], relative[ticks, worst], units, everywhere, "", found)

    return look


def _apart(values: tuple[float, float, float], unit: str) -> tuple[str, str, str]:
    """A value and its two limits as text, with enough digits to distinguish them."""
    value, low, high = (readable(each, unit) for each in values)
    for digits in range(4, MOST_DIGITS + 1):
        if value not in (low, high):
            break
        value, low, high = (readable(each, unit, digits=digits) for each in values)
    return value, low, high


def _bounds(spec: LimitsSpec, robot: RobotModel) -> list[_Bound]:
    names = robot.joint_names if spec.group is None else robot.group(spec.group).joints
    found = []
    for name in names:
        joint = robot.joint(name)
        limits, n = joint.limits, len(robot.joint_names)
        (column,) = robot.indices((name,))
        symmetric = {"velocity": limits.velocity, "effort": limits.effort}
        for k, what in enumerate(ALL):
            unit = _UNITS[what][1 if joint.type == "prismatic" else 0]
            if what not in spec.of:
                continue
            if what == "position" and limits.lower is not None and limits.upper is not None:
                middle, half = (limits.lower + limits.upper) / 2.0, (limits.upper - limits.lower) / 2.0
                found.append(_Bound(name, what, unit, column, middle, half))
            most = symmetric.get(what)
            if most is not None:
                found.append(_Bound(name, what, unit, k * n + column, 0.0, most))
    return found


def check(spec: LimitsSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown group, or joints without limits."""
    unknown = unknown_group(context.robot, spec.group, ("group",))
    if not unknown and not _bounds(spec, context.robot):
        return (Problem((), f"no joint has a {' or '.join(spec.of)} limit"),)
    return unknown


def absent(spec: LimitsSpec, world: World) -> str | None:
    """Effort limits need an engine with efforts."""
    reason = effortless(world)
    if reason is None or all(bound.what != "effort" for bound in _bounds(spec, world.robot)):
        return None
    others = [what for what in spec.of if what != "effort"]
    return f"{reason}; use `of: [{', '.join(others)}]`" if others else reason


def clause(spec: LimitsSpec, robot: RobotModel) -> str:
    who = "all joints" if spec.group is None else f"the joints of group {named(spec.group)}"
    spare = f" with {share(spec.spare)} to spare" if spec.spare else ""
    return f"{who} stay within their limits of {listing(spec.of)}{spare}"


LIMITS = Condition(
    name="limits",
    spec=LimitsSpec,
    units=("rad", "m", "rad/s", "m/s", "N m", "N"),
    open=monitor,
    check=check,
    absent=absent,
    scope="always",
    clause=clause,
    example="limits: {group: arm, of: [velocity, effort], spare: 10 %}",
)
