"""Grasps of objects that are too light for the force, which the engine lets creep in the hand."""

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
    """Grasps of objects of next to no mass beside the force, by which the engine lets them creep, whatever gravity is.

    Its solver stops after a number of iterations, each of which carries an impulse from one finger through the object
    to the other: of two that are heavy beside what is between them, an error of their forces is left, and moves it.
    """
    task, plan = subject.task, subject.plan
    for one in grasps(plan):
        if one.end.carried is None:
            continue
        body = task.scene.body(one.end.carried.body)
        if one.force > LIGHT * body.mass:
            message = f"step '{one.step}': {one.force:.3g} N are much for '{body.name}' of "
            message += f"{readable(body.mass, 'kg')}: it may creep in the hand by millimetres"
            hint = f"a force below {digits(LIGHT * body.mass)} N, or more mass: the contact solver of the engine "
            hint += "leaves errors that move light things between heavy ones"
            yield Diagnostic("TASK239", message, task.file.place("steps", one.index), hint, "warning")


CHECK = Check(name="light_objects", codes=("TASK239",), findings=findings, needs_plan=True)
