"""Can the hands of a task close as fast, and press as hard, as they are asked to?"""

from __future__ import annotations

import math
from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import told_apart
from manipcli.flow.load import Task
from manipcli.flow.plan import Plan
from manipcli.spec.controllers import GripperSpec


def too_swift(task: Task) -> Iterator[Finding]:
    """Hands whose references are to move faster than a joint may; the default never is."""
    for name, spec in task.controllers.controllers.items():
        if not isinstance(spec, GripperSpec) or spec.speed is None:
            continue
        limits = {joint: task.robot.joint(joint).limits.velocity for joint in spec.joints}
        limit, joint = min((limit or math.inf, joint) for joint, limit in limits.items())
        if spec.speed > limit:
            unit = "m/s" if task.robot.joint(joint).type == "prismatic" else "rad/s"
            swift, most = told_apart(spec.speed, limit, form=".3g")
            message = f"{joint}: its references move at {swift} {unit}, its velocity limit is {most} {unit}"
            place = task.controllers_file.place("controllers", name, "speed")
            yield Finding("CTRL167", message, place, "without `speed` they move as fast as all joints may", "warning")


def strained(task: Task, plan: Plan) -> Iterator[Finding]:
    """Grasps with more force than a finger that slides can press with.

    Fingers that mimic it take their part: the effort is that of all of them, f (1 + sum |multiplier|).
    """
    owners = [one for one in task.controllers.controllers.values() if isinstance(one, GripperSpec)]
    for k, step in enumerate(plan.steps):
        grips = [motion.grip for motion in step.plan.motions if motion.grip is not None]
        for force, name in ((grip.force, name) for grip in grips if grip.force is not None for name in grip.joints):
            joint = task.robot.joint(name)
            limits = [joint.limits.effort, *(one.max_effort for one in owners if name in one.joints)]
            mimics = [one.mimic for one in task.robot.joints if one.mimic is not None and one.mimic.joint == name]
            fingers = 1.0 + sum(abs(mimic.multiplier) for mimic in mimics)
            most = min((limit for limit in limits if limit), default=math.inf) / fingers
            if joint.type == "prismatic" and force > most:
                message = f"step '{step.id}': a grasp with {force:.3g} N; {name} presses with {most:.3g} N at most"
                hint = "lower `force`, or raise what limits it: the joint's effort, or `max_effort`"
                yield Finding("TASK238", message, task.file.place("steps", k), hint, "warning")
