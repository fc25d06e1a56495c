"""Loading of a task file and its robot and controllers files. `second_chances` collects all errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, Unpack

from manipcli.core.errors import InvalidInput
from manipcli.description.packages import Packages
from manipcli.judge.drawn import Drawn
from manipcli.model.build_robot import build_robot
from manipcli.scene.build_scene import build_scene
from manipcli.spec.load import load_controllers, load_robot
from manipcli.spec.load import load_task as load_task_file
from manipcli.task.believed_scene import believing
from manipcli.task.changed_files import Files, bound
from manipcli.task.compliance_checks import compliance_findings
from manipcli.task.consistency import consistent
from manipcli.task.designs import Design
from manipcli.task.named_file import named_file
from manipcli.task.sample import draw_sample, drawn_sample
from manipcli.task.second_chances import every_finding
from manipcli.task.sensor_checks import refuse, sensed, sensor_findings
from manipcli.task.spring_checks import spring_findings
from manipcli.task.task import Task
from manipcli.task.task_files import finder
from manipcli.task.vary import Varied
from manipcli.task.vocabulary import controllers_spec, robot_spec, task_spec


class FileOptions(TypedDict, total=False):
    """How the files of a task are read; a missing key means its default.

    Attributes:
        overrides: `scene.cup.mass=80 g`, as after `--set`.
        seed: replaces the seed of the task.
        package_path: additional folders to search for packages.
        allow_outside: allow files outside packages and outside the folders of the files that name them.
        design: the design of the samples, `sobol:256`; "": random ones.
    """

    overrides: Sequence[str]
    seed: int | None
    package_path: Sequence[Path]
    allow_outside: bool
    design: str


class LoadOptions(FileOptions, total=False):
    """`FileOptions`, and the sample of the task.

    Attributes:
        sample: index of a sample of `vary:`, from 0; None for `sample:` of the file, by default the task as written.
            Values set by `overrides` are not drawn; their `offset` or `scale` is, relative to the value set.
    """

    sample: int | None


@dataclass(frozen=True, slots=True)
class WrittenTask:
    """A task as written, from which its samples are drawn.

    Attributes:
        task: the task.
        varied: the quantities of its `vary:`.
        path: the task file.
        options: how it was loaded.
    """

    task: Task
    varied: tuple[Varied, ...]
    path: Path
    options: FileOptions

    @property
    def design(self) -> Design:
        """The design of its samples."""
        return Design.read(self.options.get("design", ""))

    def drawn(self, number: int) -> Drawn:
        """The values of a sample.

        Raises:
            InvalidInput: the sample does not exist.
        """
        overrides = self.options.get("overrides", ())
        return drawn_sample(self.task, self.varied, number, design=self.design, overrides=overrides)

    def sample(self, number: int | None) -> Task:
        """A sample; None for the `sample:` of the file, or the task as written if it has none.

        Raises:
            InvalidInput: the sample does not exist, or a drawn value is refused.
        """
        number = self.task.spec.sample if number is None else number
        if number is None:
            return self.task
        return draw_sample(
            self.task,
            self.varied,
            number,
            self.path,
            design=self.design,
            overrides=self.options.get("overrides", ()),
            package_path=self.options.get("package_path", ()),
            allow_outside=self.options.get("allow_outside", False),
        )


def load_task(path: Path, *, sample: int | None = None, **options: Unpack[FileOptions]) -> Task:
    """Loads a task and all files that it names.

    Args:
        path: the task file.
        sample: see `LoadOptions`.
        options: see `FileOptions`.

    Raises:
        InvalidInput: a file or an override is invalid, the sample does not exist, or a drawn value is refused.
    """
    return load_written(path, **options).sample(sample)


def load_written(path: Path, **options: Unpack[FileOptions]) -> WrittenTask:
    """Loads a task as written and all files that it names.

    Raises:
        InvalidInput: all errors of all three files at once; errors of the scene's geometry only if the task file is
            valid.
    """
    try:
        Design.read(options.get("design", ""))
        return WrittenTask(*_as_written(path, **options), path, options)
    except InvalidInput as first:
        raise every_finding(path, first, **options) from None


def _as_written(
    path: Path,
    *,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    design: str = "",
) -> tuple[Task, tuple[Varied, ...]]:
    """The task as written, and the quantities of `vary:`.

    Raises:
        InvalidInput: the errors of the first stage that has any.
    """
    find = finder(path, package_path=package_path, allow_outside=allow_outside)
    file = load_task_file(path, model=task_spec(), overrides=overrides, seed=seed, find=find)
    robot_path, controllers_path = named_file(file, path, "robot"), named_file(file, path, "controllers")
    robot_file = load_robot(robot_path, overrides=overrides, model=robot_spec())
    robot, notes = build_robot(
        robot_file.spec,
        file=robot_path,
        package_path=package_path,
        allow_outside=allow_outside,
        source=robot_file.source,
    )
    controllers_file = load_controllers(
        controllers_path, model=controllers_spec(), overrides=overrides, args=robot_file.spec.args
    )
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    scene = build_scene(file.spec, place=lambda loc: file.place(*loc), packages=packages)
    warnings = consistent(file, controllers_file, robot, scene, sensed(file, robot_file, robot, scene))
    refuse(sensor_findings(file, robot_file, controllers_file, robot, scene))
    refuse([*spring_findings(file, scene)])
    complying = (*compliance_findings(file, robot_file, controllers_file, robot),)
    refuse([finding for finding in complying if finding.severity == "error"])
    varied = bound(Files(file, robot_file, controllers_file))
    findings = (*file.findings, *robot_file.findings, *controllers_file.findings, *notes, *warnings, *complying)
    return believing(Task(file, robot_file, controllers_file, robot, scene, findings)), varied
