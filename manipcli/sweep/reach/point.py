"""One point of a map: the task is loaded and planned as `manipcli plan --until STEP --set ...` does."""

from __future__ import annotations

from manipcli import pipeline
from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.model.collision import CollisionHit, Pair
from manipcli.plan.clearance import least_clearance
from manipcli.plan.motion_margins import manipulability
from manipcli.plan.planner import ROBOT
from manipcli.scene.scene import SEPARATOR
from manipcli.spec.counted import group
from manipcli.sweep.reach.question import PointResult, Question
from manipcli.sweep.reach.reasons import finding_reason, refusal_reason
from manipcli.task.load_task import FileOptions
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task


def plan_point(question: Question, number: int, overrides: tuple[str, ...]) -> PointResult:
    """Loads the task with these overrides, and plans it up to the step.

    The manipulability is the least along motions in which the tool follows a path, and at the end of the others.
    """
    options: FileOptions = {**question.options}
    options["overrides"] = (*question.options.get("overrides", ()), *overrides)
    try:
        task = pipeline.load_task(question.path, **options)
        task = pipeline.up_to(task, question.step)
        plan = pipeline.plan_task(task)
    except NotPlannable as refusal:
        reason = refusal_reason(refusal)
        return PointResult(
            number, "refused", code=refusal.code, step=refusal.step or "", reason=reason, cause=refusal.cause
        )
    except InvalidInput as invalid:
        finding = next(one for one in invalid.findings if one.severity == "error")
        return PointResult(number, "invalid", code=finding.code, reason=finding_reason(finding), cause=finding.message)
    near = _clearance(task, plan)
    return PointResult(
        number,
        "planned",
        clearance=None if near is None else near.distance,
        between="" if near is None else f"{near.a} and {near.b}",
        manipulability=_manipulability(plan),
    )


def _clearance(task: Task, plan: Plan) -> CollisionHit | None:
    """The nearest pair of all motions, but for links of the robot among themselves and with what the steps act on.

    What is inside such an object belongs to it.
    """
    scene = task.spec.scene
    acted_on = {getattr(step.body, "object", None) for step in task.spec.steps[: task.part.last]}
    handled = {str(name).partition(SEPARATOR)[0] for name in acted_on if name is not None}

    def is_handled(name: str) -> bool:
        root = name.partition(SEPARATOR)[0]
        owner = group(root, scene) or root
        inside = scene[owner].inside if owner in scene else None
        return root in handled or (inside is not None and is_handled(inside))

    def counts(pair: Pair) -> bool:
        return not all(name.startswith(ROBOT) or is_handled(name) for name in pair)

    hits = (least_clearance(plan.planner, motion, end, counts) for motion, _, end in plan.spans())
    return min((hit for hit in hits if hit is not None), key=lambda hit: hit.distance, default=None)


def _manipulability(plan: Plan) -> float | None:
    """The least along what the tool has to follow, and at the ends of the other motions."""
    found = []
    for kind, (motion, before, _) in zip(plan.path_kinds(), plan.spans(), strict=True):
        if motion.trajectory is not None:
            followed = kind in ("tool line", "curve")
            found.append(manipulability(plan.planner, motion.trajectory, before, only_end=not followed))
    return min((each.least for each in found if each is not None), default=None)
