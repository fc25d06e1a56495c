"""Grasps of objects too light for the grip force, which creep in the hand."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.core.units import readable
from manipcli.preflight.grips import (
    LIGHT,
    grasps,
)
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Grasps with more than `LIGHT` times the mass of the object, which creeps in the hand, with or without gravity.

    The iterative contact solver of the engine passes an impulse from one finger through the object to the other. For
    heavy fingers and a light object it stops before the forces balance, and the remaining error moves the object.
    """
    task, plan = subject.task, subject.plan
    for grasp in grasps(plan):
        if grasp.end.carried is None:
            continue
        body = task.scene.body(grasp.end.carried.body)
        if grasp.force > LIGHT * body.mass:
            most = digits(LIGHT * body.mass)
            message = f"step '{grasp.step}': force {grasp.force:.3g} N exceeds {most} N for '{body.name}' "
            message += f"({readable(body.mass, 'kg')}): it may creep in the hand by millimetres"
            hint = (
                f"lower the force below {most} N, or raise the mass: errors of the contact solver move light objects "
            )
            hint += "between heavy fingers"
            yield Diagnostic("TASK239", message, task.file.place("steps", grasp.index), hint, "warning")


CHECK = Check(name="light_objects", codes=("TASK239",), findings=findings, needs_plan=True)
