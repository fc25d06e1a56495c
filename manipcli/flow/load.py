"""Files to a task: what the user wrote, and what it means for this robot and scene."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Final

from manipcli.control.factory import controller_findings
from manipcli.core.errors import Finding, InvalidInput, Loc
from manipcli.flow.changed_files import Files, out_of_range
from manipcli.flow.gathered import Gathered
from manipcli.flow.robot_file import gather_robot
from manipcli.flow.stand_ins import named_robot, named_scene
from manipcli.flow.switches import foreseen
from manipcli.flow.unjudged import unjudged
from manipcli.flow.vary import bind
from manipcli.flow.vocabulary import task_spec
from manipcli.judge.drawn import Drawn
from manipcli.judge.expectation import expectation_problems, until_problems
from manipcli.model.build_scene import build_scene
from manipcli.model.condition import Problem, Setting
from manipcli.model.conditions import CONDITIONS
from manipcli.model.joint_units import misread_units
from manipcli.model.packages import Packages
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.model.scene_names import misnamed
from manipcli.plan import retimer
from manipcli.plan.claims import Claims, no_hand
from manipcli.plan.names import UnknownPosture
from manipcli.plan.steps import STEPS
from manipcli.simulate.engines import ENGINES
from manipcli.spec import load
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.retry import retried
from manipcli.spec.robot import RobotSpec
from manipcli.spec.salvage import intended_ids
from manipcli.spec.task import TaskSpec

SHARED: Final = ("TASK220", "TASK227")
"""A body or a frame, and a link of the robot, of one name."""


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
        lambda: load.load_controllers(controllers_path, overrides=overrides)
    )
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    scene = None
    if task is not None:
        whole = task
        scene = gathered(lambda: build_scene(whole.spec, place=lambda loc: whole.place(*loc), resolve=packages.resolve))
    told: tuple[Finding, ...] = ()
    if built:
        commanding = controllers_file if controllers_file else None
        found = unusable(read, commanding, built[0], scene or named_scene(read.spec))
        gathered.findings += [finding for finding in found if finding.severity == "error"]
        told = tuple(finding for finding in found if finding.severity != "error")
    else:
        found = tuple(_unusable(read, named_robot(read.spec), scene or named_scene(read.spec), None))
        gathered.findings += [finding for finding in found if finding.code not in SHARED]
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


def unusable(
    task: Located[TaskSpec], controllers: Located[ControllersSpec] | None, robot: RobotModel, scene: Scene
) -> tuple[Finding, ...]:
    """What each of these is sound without and what they do not have together: names that are not there, units
    that fit no joint, what the engine refuses, what no controller commands. Warnings and notes are among it."""
    claimed = _misclaimed(controllers, robot, task.spec) if controllers else ()
    misclaimed = any(finding.severity == "error" for finding in claimed)
    claims = None if misclaimed or not controllers else Claims.of(controllers.spec)
    unusable = _unusable(task, robot, scene, claims)
    warned = () if unusable else unjudged(task, robot, scene)
    misread = [*misread_units(task.spec, task.source, robot.joints, robot.groups)]
    if controllers:
        misread += misread_units(controllers.spec, controllers.source, robot.joints, robot.groups)
    return (*unusable, *_refused(task, robot), *claimed, *misread, *warned)


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
        message, hint = f"there is no file '{found}'", None
        if found.exists():
            message = f"'{found}' is {'a folder' if found.is_dir() else 'no regular file'}"
        else:
            hint = load.sibling(found)
        raise InvalidInput([task.source.finding(231, (key,), message, hint=hint)])
    return found


def _unusable(task: Located[TaskSpec], robot: RobotModel, scene: Scene, claims: Claims | None) -> list[Finding]:
    """Everything that steps, conditions and expectations speak of and that is not there; of steps also what no
    controller could carry out, where it is known who `claims` what."""
    found: list[tuple[Loc, Problem]] = []
    uncommanded: list[tuple[Loc, Problem]] = []
    refused: list[tuple[Loc, Problem]] = []
    spec = task.spec
    ids = tuple(step.id for step in spec.steps if step.id is not None)
    setting = Setting(robot, scene, ids)
    if task.source.kept:
        setting = Setting(robot, scene, intended_ids(task.source, STEPS.names), in_order=False)
    for k, step in enumerate(spec.steps):
        member, at = STEPS[step.verb], ("steps", k, step.verb)
        unknown = member.check(step.body, robot, scene)
        if claims is not None and not claims.hand and any(isinstance(p, UnknownPosture) for p in unknown):
            unknown = (no_hand(robot), *(p for p in unknown if not isinstance(p, UnknownPosture)))
        found += [(at, p) for p in unknown]
        if claims is not None and not unknown:
            without = member.uncommanded(step.body, robot, claims)
            uncommanded += [(at, p) for p in without]
            switch = member.request(step.body)
            if switch is not None and not without:
                misfits, claims = foreseen(switch, claims, robot)
                refused += [(at, p) for p in misfits]
        if step.until is not None:
            found += [(("steps", k, "until"), p) for p in until_problems(step.until, step.id, setting, CONDITIONS)]
    for key, expectations in (("expect", spec.expect), ("watch", spec.watch)):
        for k, expected in enumerate(expectations):
            found += [((key, k), p) for p in expectation_problems(expected, setting, CONDITIONS)]
    again: list[Finding] = []
    for k, step in enumerate(() if task.source.kept else spec.steps):
        try:
            tried = retried(task, k)
        except InvalidInput as invalid:
            again += [replace(one, message=f"{one.message}, when it is tried again") for one in invalid.findings]
            continue
        if tried is not step:
            loc: Loc = ("steps", k, "on_fail", "with")
            wrong = STEPS[tried.verb].check(tried.body, robot, scene)
            wrong += () if tried.until is None else until_problems(tried.until, step.id, setting, CONDITIONS)
            before = {p.message for at, p in found if at[:2] == loc[:2]}
            found += [(loc, replace(p, loc=())) for p in wrong if p.message not in before]
    findings = [
        *again,
        *(
            task.source.finding(number, (*loc, *p.loc), p.message, hint=p.hint)
            for number, told in ((230, found), (232, uncommanded), (233, refused))
            for loc, p in told
        ),
    ]
    links = {link.name for link in robot.links}
    for number, key, named in ((220, "scene", scene.bodies), (227, "frames", scene.frames)):
        message, hint = f"robot '{robot.name}' has a link of this name", "choose another: a log has one frame of a name"
        findings += [
            task.source.finding(number, (key, one.name), message, hint=hint) for one in named if one.name in links
        ]
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


def _refused(task: Located[TaskSpec], robot: RobotModel) -> tuple[Finding, ...]:
    """Why the engine of the task cannot hold its robot: told at the link, or where the task names the robot."""
    engine = task.spec.simulation.engine
    if engine not in ENGINES.names:
        return ()
    return tuple(
        replace(finding, place=finding.place or task.place("robot")) for finding in ENGINES[engine].refuses(robot)
    )


def _misclaimed(file: Located[ControllersSpec], robot: RobotModel, task: TaskSpec) -> tuple[Finding, ...]:
    """What is wrong with who commands what, and what is only to be told."""
    period = task.simulation.control_period
    return controller_findings(file.spec, robot, period, place=lambda loc: file.place(*loc))
