"""Sampling of a task with `vary:`: the model for planning and the ground truth for simulation.

Poses, sizes, limits and the clock change for planner and controllers, too. Masses, contact coefficients, gravity,
actuators, controller parameters and what sensors lose change in the simulation only: the planner and the models of
controllers keep the values in the files (`Varied.only_world`).
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
from manipcli.task.believed_scene import believed_scene
from manipcli.task.changed_files import Changes, Files
from manipcli.task.consistency import refused_by_engine
from manipcli.task.designs import Design, draw
from manipcli.task.named_file import named_file
from manipcli.task.sensor_checks import refuse, sensor_findings
from manipcli.task.task import GroundTruth, Task, all_sensors
from manipcli.task.vary import SENSORS, Varied

RobotOf = Callable[[Located[RobotSpec]], RobotModel]
SceneOf = Callable[[Located[TaskSpec]], Scene]


def draw_sample(
    task: Task,
    varied: Sequence[Varied],
    number: int,
    path: Path,
    *,
    design: Design = Design(),  # noqa: B008 (frozen)
    overrides: Sequence[str] = (),
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> Task:
    """Sample `number` of a task. Values set by `overrides` are not drawn; their `offset` or `scale` is.

    Args:
        task: the task as written.
        varied: the quantities of its `vary:`.
        number: index of the sample, from 0.
        path: the task file.
        design: the design that has this sample.
        overrides, package_path, allow_outside: the options with which the task was loaded.

    Raises:
        InvalidInput: the sample does not exist, or a drawn value is refused.
    """
    drawn = drawn_sample(task, varied, number, design=design, overrides=overrides)
    robot_path = named_file(task.file, path, "robot")
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
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


def drawn_sample(
    task: Task, varied: Sequence[Varied], number: int, *, design: Design, overrides: Sequence[str] = ()
) -> Drawn:
    """The values of a sample; the arguments are those of `draw_sample`.

    Raises:
        InvalidInput: the sample does not exist.
    """
    cause = "samples count from 0" if number < 0 else "" if varied else f"task '{task.name}' has no `vary:`"
    try:
        point = draw(varied, task.spec.simulation.seed, number, design) if not cause else None
    except IndexError as error:
        point, cause = None, str(error)
    if point is None:
        message = f"there is no sample {number}: {cause}"
        raise InvalidInput([Diagnostic("TASK235", message, task.file.place("task"))])
    return _but_for(point, varied, read_overrides(overrides))


def sampled(task: Task, varied: Sequence[Varied], drawn: Drawn, *, robot_of: RobotOf, scene_of: SceneOf) -> Task:
    """The task with drawn values.

    Args:
        task: the task as written.
        varied: the varied quantities.
        drawn: the value of each.
        robot_of, scene_of: build the robot and the scene of a changed file.

    Raises:
        InvalidInput: a drawn value is out of range, the scene cannot be built with it, or the engine refuses it.
    """
    values = dict(drawn.values)
    changes = [(quantity, values[quantity.path]) for quantity in varied if quantity.path in values]
    seen = [(quantity, value) for quantity, value in changes if not quantity.only_world]
    written = Files(task.file, task.robot_file, task.controllers_file)
    try:
        planned = written.changed(seen)
        true = written.changed(changes)
        robot = task.robot if planned.robot is written.robot else robot_of(planned.robot)
        scene = task.true.scene if planned.task is written.task else scene_of(planned.task)
        truth = GroundTruth(
            robot=robot if _same(changes, seen, "ROBOT") else robot_of(true.robot),
            scene=scene if _same(changes, seen, "TASK") else scene_of(true.task),
            controllers=true.controllers,
            sensors=all_sensors(true.robot.spec, true.task.spec),
        )
        if any(_of_sensor(quantity) for quantity, _ in changes):
            refuse(sensor_findings(true.task, true.robot, true.controllers, truth.robot, truth.scene))
        if refused := refused_by_engine(task.file, truth.robot, truth.scene):
            raise InvalidInput(refused)
        scene = believed_scene(planned.task, scene, drawn.number)
    except InvalidInput as invalid:
        findings = [
            replace(finding, message=f"{finding.message} (sample {drawn.number})") for finding in invalid.findings
        ]
        raise InvalidInput(findings) from None
    return replace(
        task, file=planned.task, robot_file=planned.robot, robot=robot, scene=scene, drawn=drawn, truth=truth
    )


def _but_for(drawn: Drawn, varied: Sequence[Varied], overrides: Sequence[Override]) -> Drawn:
    """Removes drawn values that an override sets, directly or through a block around or inside them."""

    def is_set(quantity: Varied) -> bool:
        return any(
            override.area == quantity.area and all(a == b for a, b in zip(override.path, quantity.parts, strict=False))
            for override in overrides
        )

    kept = {quantity.path for quantity in varied if quantity.how or not is_set(quantity)}
    return replace(drawn, values=tuple((path, value) for path, value in drawn.values if path in kept))


def _same(changes: Changes, seen: Changes, area: str) -> bool:
    """Whether all changes of this file but those of sensors are visible to the planner."""
    counts = [sum(q.area == area and not _of_sensor(q) for q, _ in some) for some in (changes, seen)]
    return counts[0] == counts[1]


def _of_sensor(quantity: Varied) -> bool:
    return quantity.area != "CTRL" and quantity.parts[0] == SENSORS
