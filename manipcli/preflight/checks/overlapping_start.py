"""Links of the robot that overlap at the start of the task, which the simulation cannot keep apart."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.core.units import readable
from manipcli.model.self_collision import checked_pairs, overlapping
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Pairs of links, most often of a hand, that overlap at the start: no collision between them is simulated."""
    task = subject.task
    if not task.spec.simulation.self_collision:
        return
    for (a, b), depth in overlapping(task.robot, checked_pairs(task.robot), subject.plan.start.position).items():
        message = f"links '{a}' and '{b}' overlap by {readable(depth, 'm')} at the start: they pass through each other "
        message += "in the simulation"
        hint = "set another `start: POSE`; or, if the links may overlap, list the pair under `collision_ignore`"
        yield Diagnostic("TASK247", message, task.file.place("start"), hint, "warning")


CHECK = Check(name="overlapping_start", codes=("TASK247",), findings=findings, needs_plan=True)
