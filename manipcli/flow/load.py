"""Files to a task: what the user wrote, and what it means for this robot and scene."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from manipcli.core.errors import Finding, InvalidInput, Loc
from manipcli.flow.agreement import disagreements, not_there
from manipcli.flow.changed_files import Files, out_of_range
from manipcli.flow.gathered import Gathered
from manipcli.flow.robot_file import gather_robot
from manipcli.flow.stand_ins import named_robot, named_scene
from manipcli.flow.vary import bind
from manipcli.flow.vocabulary import controllers_spec, task_spec
from manipcli.judge.drawn import Drawn
from manipcli.model.build_scene import build_scene
from manipcli.model.packages import Packages
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.scene_names import misnamed
from manipcli.plan import retimer
from manipcli.simulate.engines import ENGINES
from manipcli.spec import load
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec


@dataclass(frozen=True, slots=True)
class Truth:
    """What is simulated, where planning knows something else: robot and scene of the engine, controllers and gains."""

    robot: RobotModel
    scene: Scene
    controllers: Located[ControllersSpec]


@dataclass(frozen=True, slots=True)
class Task:
    """A task that can be planned: the three files as written, and the robot and scene that they mean.

    `findings` are warnings and notes; errors do not get here. `places`: where steps, expectations and watches were
    written, of a task that was read from a log.
    """

    file: Located[TaskSpec]
    robot_file: Located[RobotSpec]
    controllers_file: Located[ControllersSpec]
    robot: RobotModel
    scene: Scene
    findings: tuple[Finding, ...]
    places: Mapping[Loc, str] = field(default_factory=dict)
    drawn: Drawn | None = None
    truth: Truth | None = None

    @property
    def true(self) -> Truth:
        """What is simulated."""
        return self.truth or Truth(self.robot, self.scene, self.controllers_file)

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
        if path in self.places:
            return self.places[path]
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
        InvalidInput: every error of all three files at once; of the scene's geometry only once the task file is sound.
    """
    gathered = Gathered()
    model = task_spec()
    task = gathered(lambda: load.load_task(path, model=model, overrides=overrides, seed=seed))
    read = task or load.salvage_task(path, model=model, overrides=overrides, seed=seed)
    if read is None:
        raise gathered.refusal()
    gathered.unknown = read.source.unknown
    if task is None:
        gathered.findings += (*read.findings, *misnamed(read.spec, lambda loc: read.place(*loc)))
    robot_path = gathered(lambda: _named_file(read, path, "robot"))
    controllers_path = gathered(lambda: _named_file(read, path, "controllers"))
    robot_read = robot_path and gather_robot(
        robot_path, gathered, overrides=overrides, package_path=package_path, allow_outside=allow_outside
    )
    robot_file, built = (robot_read.file, robot_read.robot) if robot_read else (None, None)
    controllers_file = controllers_path and gathered(
        lambda: load.load_controllers(controllers_path, model=controllers_spec(), overrides=overrides)
    )
    controllers_read = controllers_file or (
        controllers_path
        and load.salvage_controllers_file(controllers_path, model=controllers_spec(), overrides=overrides)
    )
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    scene = None
    if task is not None:
        whole = task
        scene = gathered(lambda: build_scene(whole.spec, place=lambda loc: whole.place(*loc), packages=packages))
    told: tuple[Finding, ...] = ()
    if built:
        found = disagreements(read, controllers_read or None, built[0], scene or named_scene(read.spec))
        gathered.findings += [finding for finding in found if finding.severity == "error"]
        told = tuple(finding for finding in found if finding.severity != "error")
    else:
        gathered.findings += not_there(read, named_robot(read.spec), scene or named_scene(read.spec))
    if task is not None and robot_file and controllers_file:
        varied, wrong = bind(task, robot_file, controllers_file)
        gathered.findings += (*wrong, *out_of_range(Files(task, robot_file, controllers_file), varied))
    if task is None or scene is None or not (robot_file and controllers_file and built) or gathered.findings:
        raise gathered.refusal()
    robot, notes = built
    return Task(
        file=task,
        robot_file=robot_file,
        controllers_file=controllers_file,
        robot=robot,
        scene=scene,
        findings=(*task.findings, *robot_file.findings, *controllers_file.findings, *notes, *told),
    )


def load_libraries(task: Task) -> None:
    """Import now what planning, simulating and recording would import at their first use, so that the time of each of
    them is its own."""
    for name in ("coal", "pinocchio", "ruckig", "mcap.records", "mcap.opcode", "zstandard"):
        import_module(name)
    retimer.library()
    ENGINES[task.spec.simulation.engine].prepare()


def _named_file(task: Located[TaskSpec], path: Path, key: str) -> Path | None:
    """The file that the task names under `key`, relative to the task; None where what it names has been refused.

    Raises:
        InvalidInput: it is not there; told at the place where it is named.
    """
    if not task.source.untouched(key):
        return None
    named: str = getattr(task.spec, key)
    found = Path(os.path.normpath(path.parent / named))
    if not found.is_file():
        if found.is_dir():
            message, hint = f"'{found}' is a folder; expected a YAML file", "name the YAML file in it"
        elif found.exists():
            message, hint = f"'{found}' is no regular file; expected a YAML file", None
        else:
            message, hint = f"there is no file '{found}'", load.sibling(found)
        raise InvalidInput([task.source.finding(231, (key,), message, hint=hint)])
    return found
