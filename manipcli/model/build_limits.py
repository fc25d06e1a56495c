"""Limits of joints: those of the description, narrowed or completed by the robot file."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from manipcli.core.text import did_you_mean, listed
from manipcli.description.elements import Joint, JointLimits, SoftLimits
from manipcli.model.named_poses import interval
from manipcli.model.reporter import Reporter
from manipcli.spec.robot import LimitsSpec, RobotSpec


def with_limits(reporter: Reporter, spec: RobotSpec, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """The joints with the robot file's limits: positions narrowed only, acceleration as written or the default."""
    moving = [joint.name for joint in joints if joint.moves]
    for name in spec.limits:
        if name not in moving:
            message = f"limits: joint '{name}' is not a moving joint of the robot"
            reporter.error("ROBOT304", message, ("limits", name), hint=did_you_mean(name, moving))
    without: list[str] = []
    result = []
    for joint in joints:
        if not joint.moves:
            result.append(joint)
            continue
        limits = _overridden(reporter, joint, spec.limits.get(joint.name))
        if limits.acceleration is None and joint.mimic is None:
            without.append(joint.name)
            limits = dataclasses.replace(limits, acceleration=spec.default_acceleration)
        result.append(dataclasses.replace(joint, limits=limits))
    if without:
        many = ", ".join(without[:6]) + (", ..." if len(without) > 6 else "")
        message = (
            f"no acceleration limit for {many}; using default_acceleration, "
            f"{spec.default_acceleration:g} rad/s2 or m/s2"
        )
        hint = f"add it to the robot file: limits: {{{without[0]}: {{acceleration: ...}}}}"
        reporter.note("ROBOT330", message, ("limits",), hint=hint)
    _unlimited(reporter, [joint for joint in result if joint.independent])
    return tuple(result)


def _unlimited(reporter: Reporter, joints: Sequence[Joint]) -> None:
    """One warning each about all joints without a velocity and without an effort limit, with the lines to add."""
    slow = [joint for joint in joints if joint.limits.velocity is None]
    if slow:
        names = listed([joint.name for joint in slow])
        lines = ", ".join(f"{j.name}: {{velocity: {'0.1 m/s' if j.unit == 'm' else '1 rad/s'}}}" for j in slow)
        message = f"no velocity limit for {names}: motions of these joints cannot be planned"
        hint = f"add the limits to the robot file, such as: limits: {{{lines}}}"
        reporter.warning("ROBOT331", message, ("limits",), hint=hint)
    weak = [joint.name for joint in joints if joint.limits.effort is None]
    if weak:
        lines = ", ".join(f"{name}: {{effort: ...}}" for name in weak)
        message = f"no effort limit for {listed(weak)}: the efforts of these joints are not limited"
        hint = f"add those of the data sheet to the robot file: limits: {{{lines}}}"
        reporter.warning("ROBOT332", message, ("limits",), hint=hint)


def _overridden(reporter: Reporter, joint: Joint, own: LimitsSpec | None) -> JointLimits:
    base = joint.limits
    if own is None:
        return base
    lower, upper = base.lower, base.upper
    for key, bound in (("lower", own.lower), ("upper", own.upper)):
        if bound is None:
            continue
        outside = (base.lower is not None and bound < base.lower) or (base.upper is not None and bound > base.upper)
        if outside:
            within = interval(base.lower, base.upper)
            message = f"joint '{joint.name}': {key} {bound:g} is outside the description's {within}"
            hint = joint.meant(bound) or "choose a value inside: the robot file may only narrow the range"
            reporter.error("ROBOT305", message, ("limits", joint.name, key), hint=hint)
        elif key == "lower":
            lower = bound
        else:
            upper = bound
    return JointLimits(
        lower=lower,
        upper=upper,
        velocity=own.velocity if own.velocity is not None else base.velocity,
        effort=own.effort if own.effort is not None else base.effort,
        acceleration=own.acceleration if own.acceleration is not None else base.acceleration,
        jerk=own.jerk if own.jerk is not None else base.jerk,
        soft=_soft(reporter, joint.name, own, base, lower, upper),
    )


def _soft(
    reporter: Reporter, joint: str, own: LimitsSpec, base: JointLimits, lower: float | None, upper: float | None
) -> SoftLimits | None:
    """The description's soft limits, overridden by the robot file; they must be inside the hard limits."""
    written = (own.soft_lower, own.soft_upper, own.k_position, own.k_velocity)
    if all(value is None for value in written):
        return base.soft
    before = base.soft or SoftLimits()
    soft = SoftLimits(*(o if o is not None else b for o, b in zip(written, dataclasses.astuple(before), strict=True)))
    for key, value in (("soft_lower", own.soft_lower), ("soft_upper", own.soft_upper)):
        if value is None:
            continue
        if (lower is not None and value < lower) or (upper is not None and value > upper):
            message = f"joint '{joint}': {key} {value:g} is outside its limits {interval(lower, upper)}"
            reporter.error("ROBOT307", message, ("limits", joint, key), hint="choose a value inside the limits")
        elif soft.k_position == 0.0:
            message = f"joint '{joint}': {key} has no effect without k_position"
            hint = "add k_position, a velocity per distance [1/s]; 20 is a usual value"
            reporter.error("ROBOT308", message, ("limits", joint, key), hint=hint)
    if soft.lower is not None and soft.upper is not None and soft.lower >= soft.upper:
        message = f"joint '{joint}': soft lower limit {soft.lower:g} is not below soft upper limit {soft.upper:g}"
        reporter.error("ROBOT307", message, ("limits", joint))
    return soft
