"""Task file to checked task: one column of calls. What goes wrong is reported by `second_chances`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict, Unpack

from manipcli.core.errors import InvalidInput
from manipcli.description.packages import Packages
from manipcli.model.build_robot import build_robot
from manipcli.scene.build_scene import build_scene
from manipcli.spec.load import load_controllers, load_robot
from manipcli.spec.load import load_task as load_task_file
from manipcli.task.changed_files import Files, bound
from manipcli.task.consistency import consistent
from manipcli.task.named_file import named_file
from manipcli.task.sample import draw_sample
from manipcli.task.second_chances import every_finding
from manipcli.task.task import Task
from manipcli.task.vary import Varied
from manipcli.task.vocabulary import controllers_spec, task_spec


class FileOptions(TypedDict, total=False):
    """How the files of a task are read; a missing key means its default.

    Attributes:
        overrides: `scene.cup.mass=80 g`, as after `--set`.
        seed: replaces the seed of the task.
        package_path: more folders in which packages are looked for.
        allow_outside: files may lie outside packages and the folders of the files that name them.
    """

    overrides: Sequence[str]
    seed: int | None
    package_path: Sequence[Path]
    allow_outside: bool


class LoadOptions(FileOptions, total=False):
    """The same, and which sample of the task is meant.

    Attributes:
        sample: a number from 0, of `vary:`; None for the task as written. What `overrides` set is not drawn; its
            `offset` or `scale` is, about the value that they set.
    """

    sample: int | None


def load_task(path: Path, *, sample: int | None = None, **options: Unpack[FileOptions]) -> Task:
    """Read a task and everything it names.

    Args:
        path: the task file.
        sample: see `LoadOptions`.
        options: see `FileOptions`.

    Raises:
        InvalidInput: every error of all three files at once; errors of the scene's geometry once the task file is
            sound. Or there is no such sample, or a drawn value is refused.
    """
    try:
        task, varied = _as_written(path, **options)
    except InvalidInput as first:
        raise every_finding(path, first, **options) from None
    if sample is None:
        return task
    return draw_sample(
        task,
        varied,
        sample,
        path,
        overrides=options.get("overrides", ()),
        package_path=options.get("package_path", ()),
        allow_outside=options.get("allow_outside", False),
    )


def _as_written(
    path: Path,
    *,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> tuple[Task, tuple[Varied, ...]]:
    """The task as its files state it, and what `vary:` changes.

    Raises:
        InvalidInput: the errors of the first stage that has any.
    """
    file = load_task_file(path, model=task_spec(), overrides=overrides, seed=seed)
    robot_path, controllers_path = named_file(file, path, "robot"), named_file(file, path, "controllers")
    robot_file = load_robot(robot_path, overrides=overrides)
    robot, notes = build_robot(
        robot_file.spec,
        file=robot_path,
        package_path=package_path,
        allow_outside=allow_outside,
        source=robot_file.source,
    )
    controllers_file = load_controllers(controllers_path, model=controllers_spec(), overrides=overrides)
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    scene = build_scene(file.spec, place=lambda loc: file.place(*loc), packages=packages)
    warnings = consistent(file, controllers_file, robot, scene)
    varied = bound(Files(file, robot_file, controllers_file))
    findings = (*file.findings, *robot_file.findings, *controllers_file.findings, *notes, *warnings)
    return Task(file, robot_file, controllers_file, robot, scene, findings), varied
