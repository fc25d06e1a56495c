"""Files to a task: what the user wrote, and what it means for this robot and scene."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from manipcli.control.factory import build_controllers
from manipcli.core.errors import Finding, InvalidInput
from manipcli.judge.expectations import EXPECTATIONS
from manipcli.model.build_robot import build_robot
from manipcli.model.build_scene import build_scene
from manipcli.model.condition import Problem
from manipcli.model.conditions import CONDITIONS
from manipcli.model.packages import Packages
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.plan.steps import STEPS
from manipcli.simulate.engines import ENGINES
from manipcli.spec import load
from manipcli.spec.controllers import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec

Loc = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Task:
    """A task that can be planned: the three files as written, and the robot and scene that they mean.

    `findings` are warnings and notes; errors do not get here.
    """

    file: Located[TaskSpec]
    robot_file: Located[RobotSpec]
    controllers_file: Located[ControllersSpec]
    robot: RobotModel
    scene: Scene
    findings: tuple[Finding, ...]

    @property
    def name(self) -> str:
        """As in `task:`."""
        return self.file.spec.task

    @property
    def spec(self) -> TaskSpec:
        """The task file."""
        return self.file.spec

    @property
    def controllers(self) -> ControllersSpec:
        """The controllers file."""
        return self.controllers_file.spec

    def log_place(self, *path: str | int) -> str:
        """`pour.yaml:21:5`: no folder of this machine gets into a log."""
        place = self.file.place(*path)
        return f"{Path(place.file).name}:{place.line}:{place.column}"


def load_task(
    path: Path,
    *,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> Task:
    """Read a task and everything it names.

    Args:
        path: the task file.
        overrides: `scene.cup.mass=80 g`, as after `--set`.
        seed: instead of the task's.
        package_path: more folders to look for packages in.
        allow_outside: files may lie outside of packages and the folders of the files that name them.

    Raises:
        InvalidInput: every error of the first stage that has any: the task file; the robot and controllers files; the
            scene, the names in steps and expectations, and the controllers' claims.
    """
    task = load.load_task(
        path, steps=STEPS, conditions=CONDITIONS, expectations=EXPECTATIONS, overrides=overrides, seed=seed
    )
    robot_path, controllers_path = _named_file(task, path, "robot"), _named_file(task, path, "controllers")
    robot_file = load.load_robot(robot_path, overrides=overrides)
    controllers_file = load.load_controllers(controllers_path, overrides=overrides)
    robot, notes = build_robot(
        robot_file.spec,
        file=robot_path,
        package_path=package_path,
        allow_outside=allow_outside,
        place=lambda loc: robot_file.place(*loc),
    )
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    scene = build_scene(task.spec, place=lambda loc: task.place(*loc), resolve=packages.resolve)
    findings = [*_unknown_names(task, robot, scene), *_claims(controllers_file, robot, task.spec)]
    if findings:
        raise InvalidInput(findings)
    return Task(
        file=task,
        robot_file=robot_file,
        controllers_file=controllers_file,
        robot=robot,
        scene=scene,
        findings=(*task.findings, *robot_file.findings, *controllers_file.findings, *notes),
    )


def _named_file(task: Located[TaskSpec], path: Path, key: str) -> Path:
    """The file that the task names under `key`, relative to the task.

    Raises:
        InvalidInput: it is not there; told at the place where it is named.
    """
    named: str = getattr(task.spec, key)
    found = Path(os.path.normpath(path.parent / named))
    if not found.is_file():
        hint = load.sibling(found)
        raise InvalidInput([task.source.finding(231, (key,), f"there is no file '{found}'", hint=hint)])
    return found


def _unknown_names(task: Located[TaskSpec], robot: RobotModel, scene: Scene) -> list[Finding]:
    """Everything that steps, conditions and expectations speak of and that is not there."""
    found: list[tuple[Loc, Problem]] = []
    spec = task.spec
    for k, step in enumerate(spec.steps):
        found += [(("steps", k, step.verb), p) for p in STEPS[step.verb].check(step.body, robot, scene)]
        if step.until is not None:
            condition = CONDITIONS[step.until.name]
            found += [
                (("steps", k, "until", step.until.name), p) for p in condition.check(step.until.body, robot, scene)
            ]
    ids = tuple(step.id for step in spec.steps if step.id is not None)
    for k, expected in enumerate(spec.expect):
        problems = EXPECTATIONS[expected.name].check(expected.body, robot, scene, ids)
        found += [(("expect", k, expected.name), p) for p in problems]
    findings = [task.source.finding(230, (*loc, *p.loc), p.message, hint=p.hint) for loc, p in found]
    known = [pose.name for pose in robot.poses]
    if spec.start is not None and spec.start not in known:
        hint = f"poses: {', '.join(known)}"
        message = f"robot '{robot.name}' has no pose '{spec.start}'"
        findings.append(task.source.finding(230, ("start",), message, hint=hint))
    if spec.simulation.engine not in ENGINES.names:
        message = f"there is no engine '{spec.simulation.engine}'"
        loc = ("simulation", "engine")
        findings.append(task.source.finding(230, loc, message, hint=f"engines: {', '.join(ENGINES.names)}"))
    return findings


def _claims(file: Located[ControllersSpec], robot: RobotModel, task: TaskSpec) -> tuple[Finding, ...]:
    """What is wrong with who commands what."""
    try:
        build_controllers(file.spec, robot, task.simulation.control_period, place=lambda loc: file.place(*loc))
    except InvalidInput as invalid:
        return invalid.findings
    return ()
