"""Stability of PID loops on velocity, whose commands the motors of the engine follow without inertia."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.control.stability import RINGING, largest_velocity_gain, velocity_loop_poles
from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.preflight.preflight import Check, ControlledJoint, Subject, once
from manipcli.spec.controllers import GainsSpec


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Velocity loops that are unstable or ring."""
    period = subject.task.spec.simulation.control_period
    yield from once(
        (joint.name, finding)
        for shift in subject.shifts
        for joint in shift.servos
        if joint.gains is not None
        for finding in _unstable(joint, joint.gains, joint.ticks * period)
    )


def _unstable(joint: ControlledJoint, gains: GainsSpec, period: float) -> Iterator[Diagnostic]:
    """A velocity loop that is unstable, or changes sign every tick."""
    if gains.p == 0.0:
        return
    p, d, i = gains.p, gains.d, gains.i
    poles = velocity_loop_poles(p=p, i=i, d=d, period=period)
    most = largest_velocity_gain(i=i, d=d, period=period)
    at = f"at {1e3 * period:.3g} ms"
    if abs(poles[0]) >= 1.0:
        if p >= most > 0.0:
            message = (
                f"{joint.name}: p {digits(p)} on the velocity interface is unstable, the limit is {digits(most)} {at}"
            )
            hint = f"lower it to at most half the limit: p {digits(0.5 * most)}"
        else:
            message = f"{joint.name}: p {digits(p)}, i {digits(i)} and d {digits(d)} on the velocity interface are "
            message += f"unstable {at}"
            hint = "lower i, and d to well below 1"
    elif any(pole.real < -RINGING and abs(pole.imag) < 1e-9 for pole in poles):
        message = (
            f"{joint.name}: p {digits(p)}{f' with d {digits(d)}' if d else ''} on the velocity interface rings {at}: "
        )
        message += "its command changes sign every tick"
        hint = f"the stability limit is p {digits(most)}: lower p to at most half of it"
    else:
        return
    yield Diagnostic("CTRL157", message, joint.place, hint, "warning")


CHECK = Check(name="velocity_gains", codes=("CTRL157",), findings=findings)
