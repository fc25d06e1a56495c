"""Specs and words of task, robot and controllers files, from the registered members."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.conditions.members import CONDITIONS
from manipcli.control.controllers import CONTROLLERS
from manipcli.plan.path_planners import PATH_PLANNERS
from manipcli.plan.steps import STEPS
from manipcli.simulate.engine import EngineMember
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensors import SENSORS
from manipcli.spec.base import about
from manipcli.spec.condition import COMBINATIONS, QUANTIFIERS
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.robot import RobotSpec
from manipcli.spec.structure.words import WORDS
from manipcli.spec.task import TaskSpec
from manipcli.spec.unions import controllers_model, robot_model, task_model


def task_spec() -> type[TaskSpec]:
    """`TaskSpec` with all verbs, conditions, engines, path planners and sensors; always the same class."""
    return task_model(STEPS, CONDITIONS, ENGINES, PATH_PLANNERS, SENSORS)


def robot_spec() -> type[RobotSpec]:
    """`RobotSpec` with all sensors; always the same class."""
    return robot_model(SENSORS)


def controllers_spec() -> type[ControllersSpec]:
    """`ControllersSpec` with all types of controllers; always the same class."""
    return controllers_model(CONTROLLERS)


def _about_engine(member: EngineMember) -> str:
    physics = "Physics" if member.physics == "full" else "Ideal tracking, no physics"
    missing = member.missing()
    return f"{physics}. Not installed; {missing}." if missing else f"{physics}."


def meanings(kind: str) -> Mapping[str, str]:
    """One-line description of each word of a kind (`steps`, `conditions`, `expectations`, `engines`, `sensors`); empty
    for other kinds."""
    conditions = {member.name: about(member.spec) for member in CONDITIONS} | COMBINATIONS
    descriptions = {
        "steps": {member.name: about(member.spec) for member in STEPS} | {**WORDS},
        "conditions": conditions,
        "expectations": conditions | QUANTIFIERS,
        "sensors": {member.name: about(member.spec) for member in SENSORS},
        "engines": {member.name: _about_engine(member) for member in ENGINES},
    }
    return descriptions.get(kind, {})
