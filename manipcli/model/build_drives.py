"""Transmissions and actuators of a robot, from the robot file and its descriptions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.text import did_you_mean
from manipcli.description.elements import Joint, TransmissionTag
from manipcli.description.transmissions import BY_TYPE, TRANSMISSIONS
from manipcli.model.robot import Actuator
from manipcli.spec.robot import RobotSpec, TransmissionSpec

if TYPE_CHECKING:
    from manipcli.model.reporter import Reporter


def build_transmissions(
    reporter: Reporter, spec: RobotSpec, joints: Sequence[Joint], described: Sequence[TransmissionTag]
) -> tuple[TransmissionTag, ...]:
    """The transmissions of the descriptions, then those of the robot file.

    A transmission of the robot file replaces described transmissions of the same joints or the same name. Replacing
    only one joint of a described pair is an error.
    """
    driven = {joint.name: joint for joint in joints}
    commanded = [joint.name for joint in joints if joint.independent]
    owners: dict[str, str] = {}
    own: dict[str, TransmissionTag] = {}
    for name, each in spec.transmissions.items():
        loc = ("transmissions", name)
        for k, joint_name in enumerate(each.joints):
            joint = driven.get(joint_name)
            if joint is None:
                message = f"transmission '{name}': joint '{joint_name}' is not in the robot"
                hint = did_you_mean(joint_name, commanded)
                reporter.error("ROBOT340", message, (*loc, "joints", k), hint=hint)
            elif not joint.independent:
                what = f"mimics '{joint.mimic.joint}'" if joint.mimic is not None else "is fixed"
                message = f"transmission '{name}': joint '{joint_name}' {what} and cannot have an actuator"
                reporter.error("ROBOT341", message, (*loc, "joints", k))
        for key, names in (("joints", each.joints), ("actuators", each.actuators)):
            for k, part in enumerate(names):
                owner = owners.setdefault(f"{key} {part}", name)
                if owner != name:
                    message = f"transmission '{name}': {key[:-1]} '{part}' already belongs to transmission '{owner}'"
                    reporter.error("ROBOT342", message, (*loc, key, k))
        own[name] = _tag(name, each)
    replaced = {joint for tag in own.values() for joint in tag.joints}
    kept = []
    for tag in described:
        if tag.name in own or replaced.issuperset(tag.joints):
            continue
        shared = replaced.intersection(tag.joints)
        if shared:
            owner = owners[f"joints {min(shared)}"]
            message = f"transmission '{owner}' replaces only joint '{min(shared)}' of '{tag.name}' in the description"
            hint = f"let '{owner}' drive all joints of '{tag.name}': {' and '.join(tag.joints)}"
            reporter.error("ROBOT343", message, ("transmissions", owner, "joints"), hint=hint)
        kept.append(tag)
    return (*kept, *own.values())


def build_actuators(
    reporter: Reporter, spec: RobotSpec, joints: Sequence[Joint], transmissions: Sequence[TransmissionTag]
) -> tuple[Actuator, ...]:
    """The actuators of the robot file; each belongs to a transmission."""
    known = [name for tag in transmissions if tag.type in BY_TYPE for name in tag.actuators]
    for name in spec.actuators:
        if name not in known:
            message = f"actuator '{name}' is not in a transmission of the robot"
            hint = did_you_mean(name, known) or "add it to a transmission under `transmissions:`"
            reporter.error("ROBOT344", message, ("actuators", name), hint=hint)
    for tag in transmissions:
        _compare_speeds(reporter, spec, joints, tag)
    return tuple(
        Actuator(
            name=name,
            effort=each.effort,
            velocity=each.velocity,
            rotor_inertia=each.rotor_inertia,
            viscous_friction=each.viscous_friction,
            coulomb_friction=each.coulomb_friction,
            efficiency=each.efficiency,
            latency=each.latency,
        )
        for name, each in spec.actuators.items()
    )


def _compare_speeds(reporter: Reporter, spec: RobotSpec, joints: Sequence[Joint], tag: TransmissionTag) -> None:
    """A note for each actuator that is too slow for its joints: planning uses the joints' limits only."""
    by_name = {joint.name: joint for joint in joints}
    limits = [by_name[name].limits.velocity for name in tag.joints if name in by_name]
    if tag.type not in BY_TYPE or len(limits) < len(tag.joints) or None in limits:
        return
    maps = BY_TYPE[tag.type].of(tag, spec.compat or "ros2").maps
    needed = np.abs(maps.actuator_motion) @ np.array(limits, dtype=np.float64)
    for name, speed in zip(tag.actuators, needed, strict=True):
        own = spec.actuators.get(name)
        if own is None or own.velocity is None or speed <= own.velocity * (1.0 + 1e-9):
            continue
        message = f"actuator '{name}' is limited to {own.velocity:.4g} rad/s or m/s and needs {speed:.4g}"
        message += f" with {' and '.join(tag.joints)} at their velocity limits"
        hint = f"lower them: limits: {{{tag.joints[0]}: {{velocity: ...}}}}"
        reporter.note("ROBOT345", message, ("actuators", name, "velocity"), hint=hint)


def _tag(name: str, spec: TransmissionSpec) -> TransmissionTag:
    ones = (1.0,) * len(spec.joints)
    actuators, joints = spec.actuator_reduction or ones, spec.joint_reduction or ones
    if spec.type == "simple":
        actuators, joints = (actuators[0] * joints[0],), ones
    return TransmissionTag(
        name=name,
        type=TRANSMISSIONS[spec.type].type,
        joints=spec.joints,
        joint_reductions=joints,
        joint_offsets=spec.joint_offset or (0.0,) * len(spec.joints),
        actuators=spec.actuators,
        actuator_reductions=actuators,
    )
