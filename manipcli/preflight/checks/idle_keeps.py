"""Constraints of `keep` about a held object in steps that move none, and about contents of an empty one."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.text import listed
from manipcli.preflight.preflight import Check, Subject

OF_HELD = ("upright", "slosh")
"""Keys of `keep` that need a held object."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """`upright` and `slosh` where the hand is empty in all motions, `slosh` where what it holds is empty."""
    task, plan = subject.task, subject.plan
    for planned in plan.every:
        k, step = planned.index, task.spec.steps[planned.index]
        states = [motion.begins for motion in planned.plan.motions if motion.begins is not None]
        held = [(state, state.carried.body) for state in states if state.carried is not None]
        bodies = dict.fromkeys(body for _, body in held)
        empty = not any(plan.planner.contents(state, body) for state, body in held)
        for j, keep in enumerate(step.keep):
            for word in OF_HELD:
                if getattr(keep, word) is None:
                    continue
                if not held:
                    message = (
                        f"step '{planned.id}': `keep: {word}` has no effect: the hand holds nothing in its motions"
                    )
                    hint = "move it to a step that carries an object, or remove it"
                elif word == "slosh" and empty:
                    names = listed([repr(body) for body in bodies])
                    message = f"step '{planned.id}': `keep: slosh` without contents: {names} is empty in the plan"
                    hint = "it then holds for the centre of the object; remove it, or place contents inside"
                else:
                    continue
                at: Loc = ("steps", k, "keep", j, word)
                yield Diagnostic("TASK249", message, task.file.place(*at), hint, "warning")


CHECK = Check(name="idle_keeps", codes=("TASK249",), findings=findings, needs_plan=True, needs_physics=False)
