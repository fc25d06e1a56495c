"""Velocity limits, friction and latency of actuators without effect: their joints are not commanded by effort."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.text import listed
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import Actuator
from manipcli.preflight.preflight import Check, Shift, Subject, once
from manipcli.spec.controllers import Interface
from manipcli.task.task import Task

FASTER: Final = 1.0 + 1e-6
"""Ratio to the velocity limit of an actuator above which a plan exceeds it."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Actuator settings without effect, one finding per controller."""
    yield from once(found for shift in subject.shifts if shift.servos for found in _of_shift(subject.task, shift))


def _of_shift(task: Task, shift: Shift) -> Iterator[tuple[str, Diagnostic]]:
    velocity = shift.configurations.velocity
    train = Drivetrain.of(task.robot)
    speeds = np.abs(velocity[:, list(train.joints)] @ train.transmission.maps.actuator_motion.T).max(
        axis=0, initial=0.0
    )
    owners = {joint.name: joint for joint in shift.servos}
    groups: dict[tuple[str, Interface], list[int]] = {}
    for row, k in enumerate(train.joints):
        owner = owners.get(task.robot.joint_names[k])
        if owner is not None and _inert(train.actuators[row]):
            groups.setdefault((owner.controller, owner.interfaces[0]), []).append(row)
    for (controller, interface), rows in groups.items():
        own = [train.actuators[row] for row in rows]
        *most, last = (word for word in _WORDS if any(word in _inert(actuator) for actuator in own))
        words = f"{', '.join(most)} and {last}" if most else last
        names = listed([f"'{actuator.name}'" for actuator in own])
        message = (
            f"{'actuator' if len(own) == 1 else 'actuators'} {names}: {words} {'have' if most else 'has'} no effect "
        )
        message += f"under the {interface} commands of '{controller}'"
        fast = [
            f"'{actuator.name}' at {speeds[row]:.3g} (limit {actuator.velocity:.3g})"
            for actuator, row in zip(own, rows, strict=True)
            if actuator.velocity is not None and speeds[row] > FASTER * actuator.velocity
        ]
        hint = "use effort commands"
        if fast:
            message += f"; the plan moves {listed(fast, most=3)} per second"
            hint += ", or lower the velocity limits of the joints (robot file, limits)"
        place = task.robot_file.place("actuators", own[0].name)
        yield "", Diagnostic("CTRL158", message, place, hint, "warning")


_WORDS: Final = ("velocity limit", "friction", "latency")


def _inert(actuator: Actuator) -> tuple[str, ...]:
    """The settings of an actuator that act only on joints commanded by effort."""
    given = (
        actuator.velocity is not None,
        actuator.viscous_friction > 0.0 or actuator.coulomb_friction > 0.0,
        actuator.latency > 0,
    )
    return tuple(word for word, there in zip(_WORDS, given, strict=True) if there)


CHECK = Check(name="inert_actuators", codes=("CTRL158",), findings=findings)
