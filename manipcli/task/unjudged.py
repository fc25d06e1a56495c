"""Warnings before a run for conditions that cannot be evaluated."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from manipcli.conditions.condition import Seen, World
from manipcli.conditions.formula import absent
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.sensed import Sensed
from manipcli.core.errors import Diagnostic, Severity
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.plan.steps import STEPS
from manipcli.scene.scene import Scene
from manipcli.simulate.engines import ENGINES
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec

TOPICS: Final[dict[Seen, str]] = {
    "bodies": "tf",
    "contacts": "contacts",
    "references": "controller_state",
    "sensors": "sensors",
}
"""Topic of `record:` that each kind of evidence needs."""


def unjudged(
    task: Located[TaskSpec], robot: RobotModel, scene: Scene, sensors: Mapping[str, Sensed]
) -> Iterator[Diagnostic]:
    """Warnings for expectations and watches that need a topic left out of `record:`, and for each `until` that the
    engine cannot evaluate; an error if it guards a move."""
    left_out = {seen: topic for seen, topic in TOPICS.items() if topic in task.spec.record.left_out}
    physics = task.spec.simulation.engine not in ENGINES.names or ENGINES[task.spec.simulation.engine].physics == "full"
    if not left_out and physics:
        return
    nothing = np.zeros(())
    start = WorldState(*([nothing] * 8))  # no margin is computed here
    steps = tuple(step.id for step in task.spec.steps if step.id is not None)
    world = World(robot, scene, start, unrecorded=left_out, steps=steps, sensors=sensors)
    for key, expectations in (("expect", task.spec.expect), ("watch", task.spec.watch)):
        for k, expected in enumerate(expectations):
            topic = absent(expected.condition, world, CONDITIONS)
            if topic in left_out.values():
                yield Diagnostic(
                    "TASK236",
                    f"'{expected.condition.name}' cannot be judged and fails: `record:` leaves '{topic}' out",
                    task.place(key, k),
                    hint=f"add {topic} to record.topics",
                    severity="warning",
                )
    referenced = frozenset(robot.joint_names)
    live = World(robot, scene, start, physics=physics, referenced=referenced, steps=steps, sensors=sensors)
    for k, step in enumerate(task.spec.steps):
        reason = None if step.until is None else absent(step.until, live, CONDITIONS)
        if reason is not None:
            guarded = STEPS[step.verb].guarded(step.body)
            message = f"`until` {'cannot guard this move' if guarded else 'is not waited for'}: {reason}"
            severity: Severity = "error" if guarded else "warning"  # it would not stop where the plan expects it to
            yield Diagnostic("TASK237", message, task.place("steps", k, "until"), severity=severity)
