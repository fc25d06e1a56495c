"""The findings of all preflight checks of a task."""

from __future__ import annotations

from manipcli.core.errors import Diagnostic, NotPlannable
from manipcli.core.registry import Seam
from manipcli.preflight.checks import PREFLIGHT_CHECKS
from manipcli.preflight.preflight import Check, Subject
from manipcli.simulate.engines import ENGINES
from manipcli.task.plan_task import Plan, plan_task
from manipcli.task.task import Task


def preflight_findings(
    task: Task, plan: Plan | None = None, *, checks: Seam[Check] = PREFLIGHT_CHECKS
) -> tuple[Diagnostic, ...]:
    """Warnings about gains, efforts, grasps and timeouts, with a value that works, each at its place in its file.

    For an engine without physics, gains, efforts and forces are not checked.

    Args:
        task: the task to check.
        plan: its plan; None: plan it here. If planning fails, the findings include the refusal, and gains are checked
            at the named poses.
        checks: the registry.
    """
    found: list[Diagnostic] = []
    if plan is None:
        try:
            plan = plan_task(task)
        except NotPlannable as refusal:
            found += refusal.findings
    subject = Subject(task, plan)
    physics = ENGINES[task.spec.simulation.engine].physics == "full"
    for check in checks:
        if (plan is not None or not check.needs_plan) and (physics or not check.needs_physics):
            found += check.findings(subject)
    return tuple(found)
