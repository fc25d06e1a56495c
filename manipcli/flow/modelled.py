"""Joints whose effort comes from the model of the robot, by computed torque or as an impedance: can they work?

Their gains do not meet the inertia of one joint. What can be asked is whether there is effort enough, and of computed
torque whether the error, e'' = -p e - d e' - i z with z its sum, comes to rest when it is looked at once a tick.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.control.controllers.computed_torque import error_gains
from manipcli.control.joint_space_load import Configurations, load_of
from manipcli.control.stability import Loop, boundary, is_stable
from manipcli.core.errors import Finding, Place
from manipcli.core.text import digits
from manipcli.flow.doubt import Doubt
from manipcli.flow.drives import too_weak
from manipcli.flow.load import Task
from manipcli.flow.weak import throttled
from manipcli.model.kinematics import Kinematics
from manipcli.spec.controllers import GainsSpec
from manipcli.spec.other_controllers import CartesianImpedanceSpec, ComputedTorqueSpec

SLOWEST: Final = 1e-6
"""[rad a tick] A natural frequency that is stable with any latency of a motor."""


@dataclass(frozen=True, slots=True)
class Modelled:
    """One joint, by whom, control ticks between two updates, and where its controller names it."""

    controller: str
    joint: str
    ticks: int
    place: Place


def modelled_joints(task: Task, active: Collection[str]) -> tuple[Modelled, ...]:
    """Those of these controllers."""
    period = task.spec.simulation.control_period
    found = []
    for name, spec in task.controllers.controllers.items():
        if name not in active or not isinstance(spec, ComputedTorqueSpec | CartesianImpedanceSpec):
            continue
        ticks = spec.ticks(period)
        place = task.controllers_file.place("controllers", name, "joints")
        found += [Modelled(name, joint, ticks, place) for joint in spec.joints]
    return tuple(found)


def modelled_doubts(
    task: Task, joints: tuple[Modelled, ...], kinematics: Kinematics, postures: Configurations, *, planned: bool
) -> Iterator[Doubt]:
    """Warnings about them, over the postures in which they will be."""
    load = load_of(task.robot, kinematics, [one.joint for one in joints], postures)
    told: set[Place | None] = set()
    for k, one in enumerate(joints):
        spec = task.controllers.controllers[one.controller]
        if isinstance(spec, ComputedTorqueSpec):
            finding = _unstable(task, one, spec, late=load.latency[k])
            if finding is not None and finding.place not in told:  # a bandwidth is that of all its joints
                told.add(finding.place)
                yield Doubt("", finding)
        weight, needed = (float(np.abs(part[:, k]).max()) for part in (load.gravity, load.needed))
        finding = too_weak(
            task.robot, one.joint, one.place, weight=weight, needed=needed if planned else 0.0,
            limit=float(load.effort[k]),
        )  # fmt: skip
        if finding is None and planned:
            velocity = postures.velocity[:, task.robot.joint_names.index(one.joint)]
            finding = throttled(task.robot.joint(one.joint), one.place, load.needed[:, k], velocity)
        if finding is not None:
            yield Doubt(one.joint, finding)


def _unstable(task: Task, one: Modelled, spec: ComputedTorqueSpec, *, late: int) -> Finding | None:
    """An error that does not come to rest; `late`: control ticks from a command to its effort."""
    simulation = task.spec.simulation
    period = one.ticks * simulation.control_period

    def loop(gains: GainsSpec) -> Loop:
        return Loop.of_joint(
            1.0, p=gains.p, i=gains.i, d=gains.d, period=period, substeps=round(period / simulation.step),
            delay=math.ceil(late / one.ticks),
        )  # fmt: skip

    own = spec.gains.get(one.joint)
    if is_stable(loop(error_gains(spec.bandwidth, spec.damping_ratio) if own is None else own)):
        return None
    slowest = SLOWEST / (math.tau * period)
    most = slowest * boundary(lambda factor: loop(error_gains(factor * slowest, spec.damping_ratio)))
    at = f"unstable above {digits(most)} Hz" if own is None else "unstable"
    at += f" at {1e3 * period:.3g} ms" + (f" and {late} ticks of latency" if late else "")
    if own is None:
        place = task.controllers_file.place("controllers", one.controller, "bandwidth")
        message = f"{one.controller}: a bandwidth of {digits(spec.bandwidth)} Hz is {at}"
        return Finding("CTRL150", message, place, f"stay below half of that: {digits(0.5 * most)} Hz", "warning")
    place = task.controllers_file.place("controllers", one.controller, "gains", one.joint)
    message = f"{one.joint}: p {digits(own.p)}, i {digits(own.i)} and d {digits(own.d)}, of accelerations, are {at}"
    hint = f"leave them out: a `bandwidth` chooses them, {digits(0.5 * most)} Hz at most"
    return Finding("CTRL150", message, place, hint, "warning")
