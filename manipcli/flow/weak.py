"""Is there enough of a joint's effort, and of its gains, to hold its weight where it is to stand?

At rest the loop gives u = p e + I, with the integral term I within its clamps and u within those of the command, and
u = g holds the joint against gravity g: it gives way by e = (g - I) / p.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.control.joint_space_load import JointSpaceLoad
from manipcli.core.errors import Finding, Place
from manipcli.core.geometry import Array
from manipcli.core.text import digits
from manipcli.flow.doubt import Doubt
from manipcli.flow.drives import too_weak
from manipcli.model.robot import Joint, RobotModel
from manipcli.spec.controllers import GainsSpec

SAG: Final = {"rad": 0.1, "m": 0.02}
"""A joint without a tolerance that gives way by more than this is told."""
SLOW: Final = 1.0
"""[s] that an integral may take to carry the weight, p / i."""
WEIGHTLESS: Final = 1e-6
"""[N m or N] What carries no more has no weight to hold, only rounding."""
CARRY: Final = "gravity_compensation: true carries it"


@dataclass(frozen=True, slots=True)
class Held:
    """One joint on an effort loop: its gains, control ticks between two updates, whether its weight is carried for it,
    its tolerance [rad or m], and where its gains are written."""

    joint: str
    gains: GainsSpec
    ticks: int
    weightless: bool
    tolerance: float | None
    place: Place


def weak(
    robot: RobotModel, loop: Held, load: JointSpaceLoad, k: int, *, velocity: Array, planned: bool
) -> Iterator[Doubt]:
    """Too little effort for gravity or for the plan; gains and clamps too weak to stand where it shall.

    Args:
        robot: whose joint it is.
        loop: that holds it.
        load: what the joints meet in T postures; this one is number `k`.
        velocity: (T,) its own there [rad/s or m/s].
        planned: whether the postures are those of a plan.
    """
    gravity = load.gravity[:, k]
    weight, limit = float(np.abs(gravity).max()), float(load.effort[k])
    needed = float(np.abs(load.needed[:, k]).max()) if planned else 0.0
    finding = too_weak(robot, loop.joint, loop.place, weight=weight, needed=needed, limit=limit)
    if finding is None and planned:
        finding = throttled(robot.joint(loop.joint), loop.place, load.needed[:, k], velocity)
    if finding is not None:
        yield Doubt(loop.joint, finding)
    if loop.weightless or weight <= WEIGHTLESS:
        return
    joint = robot.joint(loop.joint)
    told = _cut(loop, gravity, joint) or _sags(loop, np.clip(gravity, -limit, limit), joint)
    if told is not None:
        code, message, hint = told
        yield Doubt(loop.joint, Finding(code, f"{loop.joint}: {message}", loop.place, hint, "warning"))


def throttled(joint: Joint, place: Place, needed: Array, velocity: Array) -> Finding | None:
    """Too little effort at the planned velocities (T,): a soft limit lets only k_velocity (v_max - v) through."""
    soft, fastest = joint.limits.soft, joint.limits.velocity
    if soft is None or soft.k_velocity == 0.0 or fastest is None:
        return None
    way = np.where(needed < 0.0, -1.0, 1.0)
    left = np.maximum(soft.k_velocity * (fastest - way * velocity), 0.0)
    worst = int(np.argmax(np.abs(needed) - left))
    if abs(needed[worst]) <= left[worst] + WEIGHTLESS:
        return None
    unit, at = joint.effort_unit, f"{abs(velocity[worst]):.3g} {joint.unit}/s"
    message = f"{joint.name}: at {at} the planned motions need {abs(needed[worst]):.3g} {unit}; the "
    message += f"soft limit of its velocity (k_velocity {digits(soft.k_velocity)}) leaves {left[worst]:.3g} {unit}"
    hint = f"it will lag behind; a lower `speed` of the step, or limits.{joint.name}.k_velocity: 0 in the robot file"
    return Finding("CTRL169", message, place, hint, "warning")


def _cut(loop: Held, gravity: Array, joint: Joint) -> tuple[str, str, str] | None:
    """A clamp of the command that lets less through than what holds (T) against gravity."""
    least, most = loop.gains.u_clamp_min, loop.gains.u_clamp_max
    for key, bound, sign in (("u_clamp_max", most, 1.0), ("u_clamp_min", least, -1.0)):
        takes = float((sign * gravity).max())
        if bound is not None and takes > sign * bound + WEIGHTLESS:
            needed = f"{sign * takes:.3g} {joint.effort_unit}"
            message = f"holding against gravity takes up to {needed}, its {key} is {digits(bound)}"
            return "CTRL159", message, f"it will sink; {CARRY}, or another clamp does"
    return None


def _sags(loop: Held, gravity: Array, joint: Joint) -> tuple[str, str, str] | None:
    """By how much it gives way under what holds (T) against gravity; until an integral carries that, or for good."""
    length, unit = joint.unit, joint.effort_unit
    gains = loop.gains
    kp, ki = f"p {digits(gains.p)}", f"i {digits(gains.i)}"
    weight = float(np.abs(gravity).max())
    left, clamped = gravity, ""
    if gains.i > 0.0:
        least, most = gains.integral_bounds
        left = gravity - np.clip(gravity, least, most)
        clamped = f", whose integral is clamped to {digits(least)} ... {digits(most)},"
    most_left = float(np.abs(left).max())
    if gains.p == 0.0:
        if most_left <= WEIGHTLESS or gains.i > 0.0:  # without p the integral alone is unstable, and told so
            return None
        return "CTRL156", f"without p nothing holds {weight:.3g} {unit} of gravity; it sinks", f"give it p; {CARRY}"
    allowed = SAG[length] if loop.tolerance is None else loop.tolerance
    sag = most_left / gains.p
    if sag > allowed:
        message = f"{kp}{clamped} gives way by {sag:.2g} {length} under {weight:.3g} {unit} of gravity"
        if loop.tolerance is not None:
            message += f", more than its tolerance of {loop.tolerance:.2g} {length}"
        return "CTRL156", message, f"{CARRY}, or an i gain" if not clamped else f"{CARRY}, or a wider clamp"
    at_first = weight / gains.p
    if gains.i > 0.0 and at_first > SAG[length] and gains.p > SLOW * gains.i:
        message = f"{kp} gives way by {at_first:.2g} {length} under {weight:.3g} {unit} of gravity until its integral "
        message += f"carries it, some {gains.p / gains.i:.2g} s with {ki}"
        return "CTRL156", message, f"{CARRY} at once"
    return None
