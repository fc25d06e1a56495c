"""Steps and expectations outside the part of a task that a run was asked to do.

- Steps before its first and after its last step are not run, which is no failure.
- An expectation that names such a step, in `during`, `at` or `step_done`, is not evaluated.
- But one that must hold throughout several steps fails if it does in those that were run.
- A `duration` without a step is that of the whole task, and is not evaluated.
- What must hold at the end of the task is not evaluated if the run was asked to stop before.
- `eventually` that does not hold in the part is not evaluated: it may hold in the rest.
- All others are judged on the part, and fail as usual.

Steps of clients of a live session are not steps of the task either, and do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from manipcli.conditions.formula import Seams, leaves, scopes
from manipcli.conditions.members.step_done import StepDoneSpec
from manipcli.judge.part import RunPart
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome
from manipcli.spec.condition import END, ExpectationSpec


def not_asked(steps: tuple[StepOutcome, ...], part: RunPart | None) -> tuple[StepOutcome, ...]:
    """The outcomes, with the steps outside the part excused."""
    if part is None or not part.partial:
        return steps
    ids = [step.id for step in steps]
    first = ids.index(part.first) if part.first in ids else 0
    last = ids.index(part.last) if part.last in ids else len(ids) - 1
    found = []
    for k, step in enumerate(steps):
        if step.excused or (first <= k <= last and not part.live):
            found.append(step)
        else:
            why = _why(part, before=k < first)
            found.append(replace(step, excused=True, planned_duration=None, text=why))
    return tuple(found)


def _why(part: RunPart, *, before: bool) -> str:
    if part.live:
        return "not run in a live session"
    return f"before '{part.first}', where this run starts" if before else f"after '{part.last}', where this run ends"


def of_part(spec: ExpectationSpec, steps: Sequence[StepOutcome]) -> ExpectationSpec:
    """The expectation, asked only of the steps of `during` that the run was asked to do, if it is asked of several."""
    outside = {step.id for step in steps if step.excused}
    inside = tuple(name for name in spec.steps if name not in outside)
    if not inside or inside == spec.steps or spec.quantifier == "eventually":
        return spec
    return spec.model_copy(update={"during": inside})


def unless_outside(
    outcome: ExpectationOutcome, spec: ExpectationSpec, part: RunPart, steps: Sequence[StepOutcome], seam: Seams
) -> ExpectationOutcome:
    """The outcome; not evaluated and excused if the expectation concerns more than the part."""
    outside = {step.id: step.text for step in steps if step.excused}
    done = [leaf.body.step for leaf in leaves(spec.condition) if isinstance(leaf.body, StepDoneSpec)]
    if outcome.outcome == "failed" and of_part(spec, steps) != spec and not outside.keys() & {*done}:
        return outcome
    named = [*spec.steps, *([spec.at] if spec.at not in (None, END) else []), *done]
    why = next((f"step '{name}' is {outside[name]}" for name in named if name in outside), "")
    if not why and not named and any(leaf.name == "duration" for leaf in leaves(spec.condition)):
        why = "it is about the duration of the whole task"
    if not why and not named and part.last and _at_end(spec, seam):
        why = f"it is judged at the end of the task; this run stopped after '{part.last}' as asked"
    if not why and spec.quantifier == "eventually" and not named and outcome.outcome == "failed":
        why = f"it did not hold in this part of the task ({outcome.text})"
    if not why:
        return outcome
    return ExpectationOutcome(outcome.name, "not_evaluated", None, outcome.unit, None, why, excused=True)


def _at_end(spec: ExpectationSpec, seam: Seams) -> bool:
    """Whether the end of the run decides."""
    if spec.at == END:
        return True
    return spec.quantifier is None and spec.at is None and "always" not in scopes(spec.condition, seam)
