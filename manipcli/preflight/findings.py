"""The findings of all preflight checks of a task."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from manipcli.core.errors import Diagnostic, NotPlannable
from manipcli.core.registry import Seam
from manipcli.preflight.checks import PREFLIGHT_CHECKS
from manipcli.preflight.preflight import Check, Subject
from manipcli.simulate.engines import ENGINES
from manipcli.task.plan_task import Plan, plan_task
from manipcli.task.task import Task


def preflight_findings(
    task: Task,
    plan: Plan | None = None,
    *,
    checks: Seam[Check] = PREFLIGHT_CHECKS,
    margins: bool = False,
    on_progress: Callable[[str], None] = lambda _: None,
    on_plan: Callable[[Plan], None] = lambda _: None,
) -> tuple[Diagnostic, ...]:
    """Warnings about gains, efforts, grasps and timeouts, with a value that works, each at its place in its file.

    For an engine without physics, gains, efforts and forces are not checked.

    Args:
        task: the task to check.
        plan: its plan; None: plan it here. If planning fails, the findings include the refusal, and gains are checked
            at the named poses.
        checks: the registry.
        margins: add a note with the margin of each grasp.
        on_progress: see `plan_task`.
        on_plan: receives the plan.
    """
    found: list[Diagnostic] = []
    if plan is None:
        try:
            plan = plan_task(task, on_progress=on_progress)
        except NotPlannable as refusal:
            found += refusal.findings
    if plan is not None:
        on_plan(plan)
    subject = Subject(task, plan)
    physics = ENGINES[task.spec.simulation.engine].physics == "full"
    for check in checks:
        if (plan is not None or not check.needs_plan) and (physics or not check.needs_physics):
            new = tuple(check.findings(subject))
            found += new
            if check.ends and new:
                break
    if margins and plan is not None:
        found += _grasp_margins(task, plan)
    return tuple(found)


def _grasp_margins(task: Task, plan: Plan) -> Iterator[Diagnostic]:
    """What each grasp of the plan holds, at its step."""
    numbers = {step.id: step.index for step in plan.every}
    for step, margin in plan.grasps():
        place = task.file.place("steps", numbers[step])
        if margin.attachment and margin.ratio < 1.0:
            hint = "it will fall: raise the limits under `tool: {holding: ...}`, or lift something lighter"
            yield Diagnostic("TASK251", f"step '{step}': {margin.text}", place, hint, "warning")
        else:
            yield Diagnostic("TASK250", f"step '{step}': {margin.text}", place, severity="note")
