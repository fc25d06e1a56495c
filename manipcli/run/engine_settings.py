"""Settings of the engine for the world of a task."""

from __future__ import annotations

from dataclasses import replace

from manipcli.model.self_collision import checked_pairs, overlapping
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task


def engine_settings(task: Task, plan: Plan) -> EngineSettings:
    """Steps, start, the engine's own settings and the links that collide, from the task and its plan.

    Resting bodies sleep where there are many. Links that overlap at the start cannot be kept apart; a preflight check
    warns of them.
    """
    simulation, start = task.spec.simulation, plan.start.position
    substeps = round(simulation.control_period / simulation.step)
    many = any(body.count is not None for body in task.spec.scene.values())
    settings = EngineSettings(simulation.step, substeps, start, simulation.own, _colliding(task, plan), sleep=many)
    state = task.part.state
    if state is None:
        return settings
    return replace(settings, start=state.position, velocity=state.velocity, twists=state.twists)


def _colliding(task: Task, plan: Plan) -> tuple[tuple[str, str], ...]:
    robot, simulation = task.true.robot, task.spec.simulation
    if not simulation.self_collision or ENGINES[simulation.engine].physics == "none":
        return ()
    pairs = checked_pairs(robot)
    deep = overlapping(robot, pairs, plan.start.position)
    return tuple(pair for pair in pairs if pair not in deep)
