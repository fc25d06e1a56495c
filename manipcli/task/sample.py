"""One sample of a task that varies: what is planned with, and what only the world knows.

Where things are, how large they are, limits and the clock are seen by planner and controllers. Masses, coefficients of
contact, gravity, actuators and everything of the controllers act in the world alone: planner and the models of
controllers keep what the files say (`Varied.only_world`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.packages import Packages
from manipcli.judge.drawn import Drawn
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.spec.located import Located
from manipcli.spec.override import Override, read_overrides
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.changed_files import Changes, Files
from manipcli.task.named_file import named_file
from manipcli.task.task import GroundTruth, Task
from manipcli.task.vary import Varied, draw

RobotOf = Callable[[Located[RobotSpec]], RobotModel]
SceneOf = Callable[[Located[TaskSpec]], Scene]


def draw_sample(
    task: Task,
    varied: Sequence[Varied],
    number: int,
    path: Path,
    *,
    overrides: Sequence[str] = (),
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> Task:
    """Sample `number` of a task; what `overrides` set is not drawn, but its `offset` or `scale` is.

    Args:
        task: as its files state it.
        varied: what its `vary:` changes.
        number: which sample, from 0.
        path: the task file; `overrides`, `package_path`, `allow_outside`: as it was loaded.

    Raises:
        InvalidInput: there is no such sample, or a drawn value is refused.
    """
    if number < 0:
        message = f"there is no sample {number}: they count from 0"
        raise InvalidInput([Diagnostic("TASK235", message, task.file.place("task"))])
    if not varied:
        message = f"there is no sample {number}: task '{task.name}' has no `vary:`"
        raise InvalidInput([Diagnostic("TASK235", message, task.file.place("task"))])
    robot_path = named_file(task.file, path, "robot")
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    drawn = _but_for(draw(varied, task.spec.simulation.seed, number), varied, read_overrides(overrides))
    return sampled(
        task,
        varied,
        drawn,
        robot_of=lambda file: build_robot(
            file.spec,
            file=robot_path,
            package_path=package_path,
            allow_outside=allow_outside,
            source=file.source,
        )[0],
        scene_of=lambda file: build_scene(file.spec, place=lambda loc: file.place(*loc), packages=packages),
    )


def sampled(task: Task, varied: Sequence[Varied], drawn: Drawn, *, robot_of: RobotOf, scene_of: SceneOf) -> Task:
    """The task with drawn values.

    Args:
        task: as it is written.
        varied: what varies, and `drawn`: the value of each.
        robot_of, scene_of: build what a changed file means.

    Raises:
        InvalidInput: a drawn value is out of range, or no scene can be built with it.
    """
    values = dict(drawn.values)
    changes = [(one, values[one.path]) for one in varied if one.path in values]
    seen = [(one, value) for one, value in changes if not one.only_world]
    written = Files(task.file, task.robot_file, task.controllers_file)
    try:
        planned = written.changed(seen)
        true = written.changed(changes)
        robot = task.robot if planned.robot is written.robot else robot_of(planned.robot)
        scene = task.scene if planned.task is written.task else scene_of(planned.task)
        truth = GroundTruth(
            robot=robot if _same(changes, seen, "ROBOT") else robot_of(true.robot),
            scene=scene if _same(changes, seen, "TASK") else scene_of(true.task),
            controllers=true.controllers,
        )
    except InvalidInput as invalid:
        told = [replace(one, message=f"{one.message} (sample {drawn.number})") for one in invalid.findings]
        raise InvalidInput(told) from None
    return replace(
        task, file=planned.task, robot_file=planned.robot, robot=robot, scene=scene, drawn=drawn, truth=truth
    )


def _but_for(drawn: Drawn, varied: Sequence[Varied], overrides: Sequence[Override]) -> Drawn:
    """Without the values that somebody set, alone or with what is around or in them."""

    def is_set(one: Varied) -> bool:
        return any(
            override.area == one.area and all(a == b for a, b in zip(override.path, one.parts, strict=False))
            for override in overrides
        )

    kept = {one.path for one in varied if one.how or not is_set(one)}
    return replace(drawn, values=tuple((path, value) for path, value in drawn.values if path in kept))


def _same(changes: Changes, seen: Changes, area: str) -> bool:
    """Whether of this file nothing changes that is not seen."""
    return sum(one.area == area for one, _ in changes) == sum(one.area == area for one, _ in seen)
