"""Settings of the engine for the world of a task."""

from __future__ import annotations

from manipcli.simulate.engine import EngineSettings
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task


def engine_settings(task: Task, plan: Plan) -> EngineSettings:
    """Steps, start and the engine's own settings, from the task and its plan."""
    simulation = task.spec.simulation
    substeps = round(simulation.control_period / simulation.step)
    return EngineSettings(simulation.step, substeps, plan.start.position, simulation.own)
