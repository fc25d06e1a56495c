"""Effort limits below the load of gravity or of the planned motions, and sag of PID loops under gravity.

At rest a PID loop gives u = p e + I, with the integral term I within its clamps and u within those of the command, and
u = g holds the joint against gravity g: it sags by e = (g - I) / p.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.control.control_loop import PidLoop
from manipcli.control.joint_space_load import JointSpaceLoad
from manipcli.core.errors import Diagnostic, Place
from manipcli.core.geometry import Array
from manipcli.core.text import digits, distinguished
from manipcli.description.elements import Joint
from manipcli.model.robot import RobotModel
from manipcli.preflight.preflight import Check, ControlledJoint, Shift, Subject, once
from manipcli.spec.controllers import GainsSpec

SAG: Final = {"rad": 0.1, "m": 0.02}
"""Largest sag without a warning, for joints without a tolerance."""
SLOW: Final = 1.0
"""[s] Largest p / i, the time in which the integral takes over the gravity load, without a warning."""
WEIGHTLESS: Final = 1e-6
"""[N m or N] A smaller gravity load is rounding."""
CARRY: Final = "set gravity_compensation: true"


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Efforts of all commanded joints; sag only of PID loops on effort."""
    yield from once(found for shift in subject.shifts for found in _of_shift(subject, shift))


def _of_shift(subject: Subject, shift: Shift) -> Iterator[tuple[str, Diagnostic]]:
    robot = subject.task.robot
    for joints in (shift.pid_efforts, shift.servos, shift.other_efforts):
        if not joints:
            continue
        load = shift.load(joints)
        for k, joint in enumerate(joints):
            velocity = shift.configurations.velocity[:, robot.joint_names.index(joint.name)]
            yield from (
                (joint.name, finding) for finding in _of_joint(robot, joint, load, k, velocity, subject.planned)
            )


def _of_joint(
    robot: RobotModel, joint: ControlledJoint, load: JointSpaceLoad, k: int, velocity: Array, planned: bool
) -> Iterator[Diagnostic]:
    """`k`: index of the joint in the load; `velocity`: (T,) of the joint [rad/s or m/s]."""
    gravity, needed = load.gravity[:, k], load.needed[:, k]
    weight, limit = float(np.abs(gravity).max()), float(load.effort[k])
    most = float(np.abs(needed).max()) if planned else 0.0
    finding = _insufficient(robot, joint.name, joint.place, weight=weight, needed=most, limit=limit)
    if finding is None and planned and "effort" in joint.interfaces:
        finding = _throttled(robot.joint(joint.name), joint.place, needed, velocity)
    if finding is not None:
        yield finding
    loop = joint.loop
    if not isinstance(loop, PidLoop) or "effort" not in joint.interfaces or loop.carries_weight or weight <= WEIGHTLESS:
        return
    own, tolerance = robot.joint(joint.name), loop.tolerances.get(joint.name)
    gains = joint.gains or GainsSpec()
    found = _clamped(gains, gravity, own) or _sags(gains, tolerance, np.clip(gravity, -limit, limit), own)
    if found is not None:
        code, message, hint = found
        yield Diagnostic(code, f"{joint.name}: {message}", joint.place, hint, "warning")


def _insufficient(
    robot: RobotModel, joint: str, place: Place, *, weight: float, needed: float, limit: float
) -> Diagnostic | None:
    """An effort limit below `weight` or `needed`, all in N m or N; None if it suffices."""
    unit = robot.joint(joint).effort_unit
    if weight > limit:
        takes, most = distinguished(weight, limit, form=".3g")
        message = f"{joint}: gravity needs up to {takes} {unit}, its effort limit is {most} {unit}"
        return Diagnostic(
            "CTRL155", message, place, "the joint will sink: check its effort limit and the masses", "warning"
        )
    if needed > limit:
        takes, most = distinguished(needed, limit, form=".3g")
        message = f"{joint}: the planned motions need up to {takes} {unit}, its effort limit is {most} {unit}"
        hint = f"the joint will lag: lower its acceleration limit (robot file, limits.{joint}.acceleration)"
        return Diagnostic("CTRL155", message, place, hint, "warning")
    return None


def _throttled(joint: Joint, place: Place, needed: Array, velocity: Array) -> Diagnostic | None:
    """Too little effort at the planned velocities (T,): a soft limit allows only k_velocity (v_max - v)."""
    soft, fastest = joint.limits.soft, joint.limits.velocity
    if soft is None or soft.k_velocity == 0.0 or fastest is None:
        return None
    direction = np.where(needed < 0.0, -1.0, 1.0)
    left = np.maximum(soft.k_velocity * (fastest - direction * velocity), 0.0)
    worst = int(np.argmax(np.abs(needed) - left))
    if abs(needed[worst]) <= left[worst] + WEIGHTLESS:
        return None
    unit, at = joint.effort_unit, f"{abs(velocity[worst]):.3g} {joint.unit}/s"
    message = f"{joint.name}: the planned motions need {abs(needed[worst]):.3g} {unit} at {at}, its "
    message += f"soft velocity limit (k_velocity {digits(soft.k_velocity)}) leaves {left[worst]:.3g} {unit}"
    hint = "the joint will lag: lower the step's `velocity_scaling`, "
    hint += f"or set limits.{joint.name}.k_velocity: 0 in the robot file"
    return Diagnostic("CTRL169", message, place, hint, "warning")


def _clamped(gains: GainsSpec, gravity: Array, joint: Joint) -> tuple[str, str, str] | None:
    """A command clamp below the effort (T,) that holds against gravity."""
    least, most = gains.u_clamp_min, gains.u_clamp_max
    for key, bound, sign in (("u_clamp_max", most, 1.0), ("u_clamp_min", least, -1.0)):
        takes = float((sign * gravity).max())
        if bound is not None and takes > sign * bound + WEIGHTLESS:
            needed = f"{sign * takes:.3g} {joint.effort_unit}"
            message = f"gravity needs up to {needed}, its {key} is {digits(bound)}"
            return "CTRL159", message, f"the joint will sink: {CARRY}, or widen the clamp"
    return None


def _sags(gains: GainsSpec, tolerance: float | None, gravity: Array, joint: Joint) -> tuple[str, str, str] | None:
    """A sag (static error) under the effort (T,) that holds against gravity, permanent or until the integral acts."""
    length, unit = joint.unit, joint.effort_unit
    kp, ki = f"p {digits(gains.p)}", f"i {digits(gains.i)}"
    weight = float(np.abs(gravity).max())
    left, clamped = gravity, ""
    if gains.i > 0.0:
        least, most = gains.integral_bounds
        left = gravity - np.clip(gravity, least, most)
        clamped = f" with its integral clamped to {digits(least)} ... {digits(most)}"
    most_left = float(np.abs(left).max())
    if gains.p == 0.0:
        if most_left <= WEIGHTLESS or gains.i > 0.0:  # the integral alone is unstable, which gain_stability reports
            return None
        message = f"p 0 sinks under its gravity load of {weight:.3g} {unit}"
        return "CTRL156", message, f"set p, or {CARRY}"
    allowed = SAG[length] if tolerance is None else tolerance
    sag = most_left / gains.p
    if sag > allowed:
        message = f"{kp}{clamped} sags {sag:.2g} {length} under its gravity load of {weight:.3g} {unit}"
        if tolerance is not None:
            message += f", more than its tolerance of {tolerance:.2g} {length}"
        return "CTRL156", message, f"{CARRY}, or widen the clamp" if clamped else f"{CARRY}, or add an i gain"
    at_first = weight / gains.p
    if gains.i > 0.0 and at_first > SAG[length] and gains.p > SLOW * gains.i:
        message = f"{kp} sags {at_first:.2g} {length} under its gravity load of {weight:.3g} {unit} "
        message += f"for about {gains.p / gains.i:.2g} s, until its integral ({ki}) carries it"
        return "CTRL156", message, CARRY
    return None


CHECK = Check(name="insufficient_effort", codes=("CTRL155", "CTRL156", "CTRL159", "CTRL169"), findings=findings)
