"""Stability of PID loops on effort: each alone at its least inertia, then all loops coupled."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.control.joint_space_load import JointSpaceLoad
from manipcli.control.stability import (
    RINGING,
    Loop,
    is_stable,
    largest_damping,
    largest_integral,
    largest_stiffness,
    poles,
    unstable_share,
)
from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits, number_of
from manipcli.preflight.preflight import Check, ControlledJoint, Shift, Subject, once
from manipcli.spec.controllers import GainsSpec

TOGETHER: Final = 16
"""Number of configurations for the check of all loops together, those with the least margins."""
SWINGING: Final = 0.1
"""Least damping ratio without a warning: an overshoot of 73 %."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Loops that are unstable, ring, or are poorly damped."""
    yield from once(found for shift in subject.shifts for found in _of_shift(subject, shift))


def _of_shift(subject: Subject, shift: Shift) -> Iterator[tuple[str, Diagnostic]]:
    joints = shift.pid_efforts
    if not joints:
        return
    load = shift.load(joints)
    simulation = subject.task.spec.simulation
    substeps = round(simulation.control_period / simulation.step)
    own, held = load.own_inertia, load.held_inertia
    all_gains = [joint.gains or GainsSpec() for joint in joints]
    stable = True
    for k, (joint, gains) in enumerate(zip(joints, all_gains, strict=True)):
        least, most = float(own[:, k].min()), float(held[:, k].max())
        loop = Loop.of_joint(
            least,
            p=gains.p,
            d=gains.d,
            i=gains.i,
            damping=float(load.damping[k]),
            period=joint.ticks * simulation.control_period,
            substeps=joint.ticks * substeps,
            delay=math.ceil(load.latency[k] / joint.ticks),
        )
        unit = subject.task.robot.joint(joint.name).inertia_unit
        found = _unstable(joint.name, loop, f"least inertia {least:.2g} {unit} over the {subject.kind}")
        if found is None:
            slow = Loop.of_joint(most, p=gains.p, d=gains.d, damping=float(load.damping[k]), period=loop.period)
            found = _swings(joint.name, slow, f"largest inertia {most:.2g} {unit} over the {subject.kind}")
        else:
            stable = False
        if found is not None:
            code, message, hint = found
            yield joint.name, Diagnostic(code, message, joint.place, hint, "warning")
    if stable:
        yield from _together(joints, all_gains, load, simulation.control_period, substeps)


def _unstable(joint: str, loop: Loop, inertia: str) -> tuple[str, str, str | None] | None:
    """(code, message, hint) of a loop that is unstable or rings; None of others."""
    p, d, i = float(loop.p[0]), float(loop.d[0]), float(loop.i[0])
    kp, kd, ki = f"p {digits(p)}", f"d {digits(d)}", f"i {digits(i)}"
    at = f"at {1e3 * loop.period:.3g} ms"
    if loop.delay is not None and loop.delay[0]:
        at += f" and {number_of(int(loop.delay[0]), 'tick')} of latency"
    if is_stable(loop):
        worst = next((z for z in poles(loop) if z.real < 0.0 and abs(z.imag) < 1e-9), 0.0)
        if abs(worst) <= RINGING:
            return None
        most = largest_damping(loop)
        message = f"{joint}: {kd} rings {at}: its effort changes sign every tick; {inertia}"
        return "CTRL150", message, f"lower d to at most half the limit: d {digits(0.5 * most)}"
    most = largest_damping(loop)
    if 0.0 < most < d:
        message = f"{joint}: {kd} is unstable, the limit is {digits(most)} {at}; {inertia}"
        return "CTRL150", message, f"lower it to at most half the limit: d {digits(0.5 * most)}"
    most_integral = largest_integral(loop)
    if 0.0 < most_integral < i:
        limit = f"the limit is {digits(most_integral)} {at}"
        message = f"{joint}: {ki} with {kp} and {kd} is unstable, {limit}; {inertia}"
        return "CTRL150", message, f"lower it to at most half the limit: i {digits(0.5 * most_integral)}"
    if most == 0.0:
        stiffest = largest_stiffness(loop)
        if 0.0 < stiffest < p:
            message = f"{joint}: {kp} with {kd} is unstable, the limit is {digits(stiffest)} {at}; {inertia}"
            return "CTRL150", message, "lower p, or take both gains from `manipcli tune`"
        message = f"{joint}: {kp}, {ki} and {kd} are unstable {at}; {inertia}"
        return "CTRL150", message, "take stable gains from `manipcli tune`"
    need = 1.4 * math.sqrt(p * float(loop.mass[0, 0]))
    message = f"{joint}: {kp}{f', {ki}' if i else ''} with {kd} is unstable (growing oscillation) {at}; {inertia}"
    return "CTRL150", message, f"set d to {digits(min(need, 0.5 * most))}"


def _swings(joint: str, loop: Loop, inertia: str) -> tuple[str, str, str | None] | None:
    p, d = float(loop.p[0]), float(loop.d[0])
    slowest = poles(loop)[0]
    if abs(slowest.imag) < 1e-12 or not 0.0 < abs(slowest) < 1.0:
        return None
    s = complex(np.log(slowest)) / loop.period
    ratio = -s.real / abs(s)
    if ratio >= SWINGING:
        return None
    message = (
        f"{joint}: p {digits(p)} with d {digits(d)} oscillates at {digits(abs(s) / math.tau)} Hz, "
        f"damping ratio {ratio:.2g}; {inertia}"
    )
    return (
        "CTRL153",
        message,
        f"set d to {digits(1.4 * math.sqrt(p * float(loop.mass[0, 0])))} for a damping ratio of 0.7",
    )


def _together(
    joints: tuple[ControlledJoint, ...], gains: list[GainsSpec], load: JointSpaceLoad, period: float, substeps: int
) -> Iterator[tuple[str, Diagnostic]]:
    """Loops that are stable alone and unstable together, at the configurations with the least margins."""
    if any(joint.ticks != 1 for joint in joints):
        return  # loops of different rates have no common tick
    p, d, i = (np.array([getattr(each, key) for each in gains]) for key in ("p", "d", "i"))
    tightest = np.argsort(-(d / load.own_inertia).max(axis=1))[:TOGETHER]
    for k in tightest:
        latency = np.array(load.latency)
        whole = Loop(load.mass[k], p, d, i, load.damping, period, substeps, latency)
        if is_stable(whole):
            continue
        pole, share = unstable_share(whole)
        worst = [j for j in np.argsort(-share) if share[j] > 0.1][:3]
        names = ", ".join(f"{joints[j].name} (d {digits(d[j])})" for j in worst)
        message = (
            f"coupled loops are unstable at {1e3 * period:.3g} ms, each alone is stable: "
            f"pole magnitude {abs(pole):.3g}, mainly from {names}"
        )
        yield "", Diagnostic("CTRL154", message, joints[worst[0]].place, "lower their d", "warning")
        return


CHECK = Check(name="gain_stability", codes=("CTRL150", "CTRL153", "CTRL154"), findings=findings)
