"""Stability of inverse dynamics controllers: the error e'' = -p e - d e' - i z, z its integral, updated per tick."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from manipcli.control.control_loop import InverseDynamicsLoop, error_gains
from manipcli.control.stability import Loop, boundary, is_stable
from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits, number_of
from manipcli.preflight.preflight import Check, ControlledJoint, Subject
from manipcli.spec.controllers import GainsSpec
from manipcli.task.task import Task

SLOWEST: Final = 1e-6
"""[rad per tick] A natural frequency that is stable with any latency of an actuator."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Unstable error dynamics; one finding per bandwidth, which all joints of a controller share."""
    reported = set()
    for shift in subject.shifts:
        joints = shift.other_efforts
        if not joints:
            continue
        for joint, latency in zip(joints, shift.load(joints).latency, strict=True):
            if isinstance(joint.loop, InverseDynamicsLoop):
                finding = _unstable(subject.task, joint, joint.loop, late=latency)
                if finding is not None and finding.place not in reported:
                    reported.add(finding.place)
                    yield finding


def _unstable(task: Task, joint: ControlledJoint, law: InverseDynamicsLoop, *, late: int) -> Diagnostic | None:
    """`late`: control ticks from a command to its effort."""
    simulation = task.spec.simulation
    period = joint.ticks * simulation.control_period

    def loop(gains: GainsSpec) -> Loop:
        return Loop.of_joint(
            1.0, p=gains.p, i=gains.i, d=gains.d, period=period, substeps=round(period / simulation.step),
            delay=math.ceil(late / joint.ticks),
        )  # fmt: skip

    own = law.gains.get(joint.name)
    if is_stable(loop(error_gains(law.bandwidth, law.damping_ratio) if own is None else own)):
        return None
    slowest = SLOWEST / (math.tau * period)
    most = slowest * boundary(lambda factor: loop(error_gains(factor * slowest, law.damping_ratio)))
    at = f"at {1e3 * period:.3g} ms" + (f" and {number_of(late, 'tick')} of latency" if late else "")
    if own is None:
        place = task.controllers_file.place("controllers", joint.controller, "bandwidth")
        message = f"{joint.controller}: bandwidth {digits(law.bandwidth)} Hz is unstable, "
        message += f"the limit is {digits(most)} Hz {at}"
        hint = f"lower it to at most half the limit: {digits(0.5 * most)} Hz"
        return Diagnostic("CTRL150", message, place, hint, "warning")
    place = task.controllers_file.place("controllers", joint.controller, "gains", joint.name)
    gains = f"p {digits(own.p)}, i {digits(own.i)} and d {digits(own.d)}"
    message = f"{joint.name}: {gains} (on acceleration) are unstable {at}"
    hint = f"remove these gains and set a `bandwidth` of at most {digits(0.5 * most)} Hz"
    return Diagnostic("CTRL150", message, place, hint, "warning")


CHECK = Check(name="error_dynamics", codes=("CTRL150",), findings=findings)
