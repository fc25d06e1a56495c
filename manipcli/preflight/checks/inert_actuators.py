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
"""From this share of an actuator's velocity limit on a plan is beyond it."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Actuators whose settings have no effect, by controller."""
    yield from once(found for shift in subject.shifts if shift.servos for found in _of_shift(subject.task, shift))


def _of_shift(task: Task, shift: Shift) -> Iterator[tuple[str, Diagnostic]]:
    """One finding for each controller."""
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
        *most, last = (word for word in _WORDS if any(word in _inert(one) for one in own))
        words = f"{', '.join(most)} and {last}" if most else last
        names = listed([f"'{one.name}'" for one in own])
        message = f"{'actuator' if len(own) == 1 else 'actuators'} {names}: {words} {'act' if most else 'acts'} on "
        message += f"effort commands alone, and '{controller}' commands by {interface}"
        fast = [
            f"'{one.name}' at {speeds[row]:.3g} (limit {one.velocity:.3g})"
            for one, row in zip(own, rows, strict=True)
            if one.velocity is not None and speeds[row] > FASTER * one.velocity
        ]
        hint = "command by effort to have them act"
        if fast:
            message += f"; the plan turns {listed(fast, most=3)} per second"
            hint += ", or narrow the velocities of the joints (robot file, limits)"
        place = task.robot_file.place("actuators", own[0].name)
        yield "", Diagnostic("CTRL158", message, place, hint, "warning")


_WORDS: Final = ("velocity limit", "friction", "latency")


def _inert(actuator: Actuator) -> tuple[str, ...]:
    """What of an actuator does not act on joints that are commanded by position or velocity."""
    said = (
        actuator.velocity is not None,
        actuator.viscous_friction > 0.0 or actuator.coulomb_friction > 0.0,
        actuator.latency > 0,
    )
    return tuple(word for word, there in zip(_WORDS, said, strict=True) if there)


CHECK = Check(name="inert_actuators", codes=("CTRL158",), findings=findings)
