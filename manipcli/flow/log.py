"""What a log is opened with, and a log judged from nothing but itself."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from manipcli import __version__
from manipcli.control.controller import Controller
from manipcli.control.controllers.force_torque_broadcaster import ForceTorqueBroadcaster
from manipcli.control.manager import ControllerManager
from manipcli.control.roles import is_follower, is_hand
from manipcli.core.errors import Finding, InvalidInput
from manipcli.flow.embedding import embeddable
from manipcli.flow.load import Task
from manipcli.flow.plan import Plan
from manipcli.flow.vocabulary import task_spec
from manipcli.judge.drawn import SAMPLE
from manipcli.judge.judge import STORED, UNTIL, judge
from manipcli.judge.verdict import Verdict
from manipcli.model.build_robot import rebuild_robot
from manipcli.model.robot import Mesh, RobotModel
from manipcli.model.scene import Scene
from manipcli.model.scene_file import scene_from_json, scene_to_json
from manipcli.plan.outline import PLAN_FILE
from manipcli.record.channels import ControllerChannel, Recorded, WrenchChannel
from manipcli.record.faults import RecordingRefused
from manipcli.record.messages import portable_name
from manipcli.record.reading import open_recording
from manipcli.record.recorder import Recorder
from manipcli.record.recording import EMBEDDED, Recording, Span
from manipcli.record.selection import Selection
from manipcli.simulate.engines import ENGINES
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.load import load_controllers_text, load_robot_text, load_task_text
from manipcli.spec.located import Located
from manipcli.spec.resolved import resolved
from manipcli.spec.retry import expressions
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec

RUNS = Path("runs")
"""Where logs go that nobody asked elsewhere, below the working directory."""
TASK, ROBOT, CONTROLLERS, URDF = "task.yaml", "robot.yaml", "controllers.yaml", "robot.urdf"
SCENE = "scene.json"
YAML, XML, JSON, BYTES = "application/yaml", "application/xml", "application/json", "application/octet-stream"


def default_log(task: Task) -> Path:
    """`runs/<task>.mcap`; the folder is made."""
    try:
        RUNS.mkdir(exist_ok=True)
    except OSError as error:
        message = f"cannot make the folder '{RUNS}' for the log: {error.strerror}"
        raise InvalidInput([Finding("LOG101", message, hint="say where it goes with --log PATH")]) from error
    return RUNS / f"{task.name}.mcap"


def open_log(
    task: Task, plan: Plan, manager: ControllerManager, path: Path, *, overwrite: bool, embed_meshes: bool
) -> Recorder:
    """A recorder whose file already holds everything that is known before the run; with `embed_meshes` the files of all
    meshes, too, so that the log is shown without any package.

    Raises:
        RecordingRefused: nothing can or may be written there; above all not over a file that the task is made from.
    """
    engine = ENGINES[task.spec.simulation.engine]
    meshes = mesh_files(task)
    files = (task.file, task.robot_file, task.controllers_file)
    for read in (*(Path(file.source.name) for file in files), *meshes.values()):
        if path.exists() and read.exists() and path.samefile(read):
            raise RecordingRefused(path, "the task is made from this file", hint="choose another name")
    embedded = embeddable(meshes) if embed_meshes else ()
    attachments = [
        (TASK, YAML, resolved(_portable_task(task.spec), expressions(task.file)).encode()),
        (ROBOT, YAML, resolved(_portable_robot(task.robot_file.spec)).encode()),
        (CONTROLLERS, YAML, resolved(task.controllers).encode()),
        (URDF, XML, task.robot.urdf.encode()),
        (SCENE, JSON, scene_to_json(task.true.scene)),
        (PLAN_FILE, JSON, plan.outline.to_json()),
    ]
    return Recorder(
        path,
        robot=task.robot,
        scene=task.true.scene,
        controllers=[recorded(controller) for controller in manager.controllers],
        period=task.spec.simulation.control_period,
        attachments=[
            *attachments,
            *((one.attachment, BYTES, one.path.read_bytes()) for one in embedded),
        ],
        metadata={
            "run": run_metadata(task),
            **({SAMPLE: task.drawn.to_metadata()} if task.drawn is not None else {}),
            "versions": {"manipcli": __version__, engine.name: engine.version()},
            "files": {name: hashlib.sha256(content).hexdigest() for name, _, content in attachments},
            "meshes": {uri: hashlib.sha256(path.read_bytes()).hexdigest() for uri, path in meshes.items()},
            **({EMBEDDED: {one.uri: one.attachment for one in embedded}} if embedded else {}),
        },
        selection=Selection(task.spec.record.strides(task.spec.simulation.control_period), task.spec.record.left_out),
        overwrite=overwrite,
    )


def run_metadata(task: Task, **end: str) -> dict[str, str]:
    """What a log says of its run: at once, and again with its `end`, for who keeps of two records the last."""
    simulation = task.spec.simulation
    engine = ENGINES[simulation.engine]
    return {
        "task": task.name,
        "seed": str(simulation.seed),
        "engine": engine.name,
        "physics": engine.physics,
        "period": repr(simulation.control_period),
        **end,
    }


def recorded(controller: Controller) -> Recorded:
    """What the log keeps of a controller."""
    if isinstance(controller, ForceTorqueBroadcaster):
        return WrenchChannel(controller.name, controller.link)
    if not controller.interfaces:
        return None
    return ControllerChannel(controller.name, controller.joints, controller.interfaces, action_of(controller))


def action_of(controller: Controller) -> Literal["", "follow_joint_trajectory", "gripper_cmd"]:
    """By which it takes goals."""
    if is_follower(controller):
        return "follow_joint_trajectory"
    return "gripper_cmd" if is_hand(controller) else ""


def mesh_files(task: Task) -> dict[str, Path]:
    """Every mesh file of the robot and of the scene, by its URI, sorted."""
    geometries = [g for link in task.robot.links for g in (*link.visuals, *link.collisions)]
    geometries += [g for body in task.scene.bodies for g in body.geometries]
    meshes = {g.shape.uri: g.shape.path for g in geometries if isinstance(g.shape, Mesh)}
    return {uri: meshes[uri] for uri in sorted(meshes)}


def _portable_task(spec: TaskSpec) -> TaskSpec:
    """The task without folders of this machine in the names of its files."""
    scene = dict(spec.scene)
    for name, body in scene.items():
        for key, shape in (("mesh", body.mesh), ("urdf", body.urdf)):
            if shape is not None:
                portable = shape.model_copy(update={"file": portable_name(shape.file)})
                scene[name] = body.model_copy(update={key: portable})
    files = {"robot": portable_name(spec.robot), "controllers": portable_name(spec.controllers)}
    return spec.model_copy(update={"scene": scene, **files})


def _portable_robot(spec: RobotSpec) -> RobotSpec:
    """The robot file without folders of this machine in the names of its descriptions."""
    attach = tuple(one.model_copy(update={"description": portable_name(one.description)}) for one in spec.attach)
    return spec.model_copy(update={"attach": attach, "description": portable_name(spec.description)})


def judge_log(path: Path, *, being_written: bool = False, doing: Callable[[str], None] = lambda _: None) -> Verdict:
    """The verdict on a log, from the log alone; a verdict stored in it is not looked at.

    Args:
        path: the log, or what a killed run left.
        being_written: the run that writes it is still on and has just flushed: that it has no end is no loss.
        doing: told of each span that is judged.

    Raises:
        InvalidInput: the file is no log of ours, is damaged, or lacks what it is judged by.
    """
    recording = open_recording(path, being_written=being_written)
    return judge_recording(replace(recording, spans=_Watched(recording.spans, doing)), path)


@dataclass(frozen=True, slots=True)
class _Watched:
    """Spans; somebody is told of each that is read."""

    spans: Iterable[Span]
    doing: Callable[[str], None]

    def __iter__(self) -> Iterator[Span]:
        for span in self.spans:
            self.doing("judging")
            yield span


def judge_recording(recording: Recording, path: Path) -> Verdict:
    """The verdict on a log that is open already; see `judge_log`."""
    expect = recorded_task_file(recording, path).spec.judged
    scene = recorded_scene(recording, path)
    return judge(recording, expect=expect, robot=recorded_robot(recording, path), scene=scene)


def recorded_task_file(recording: Recording, path: Path) -> Located[TaskSpec]:
    """The resolved task file of a log."""
    return load_task_text(attached(recording, path, TASK), f"{path.name}/{TASK}", model=task_spec())


def recorded_robot_file(recording: Recording, path: Path) -> Located[RobotSpec]:
    """The resolved robot file of a log."""
    return load_robot_text(attached(recording, path, ROBOT), f"{path.name}/{ROBOT}")


def recorded_controllers_file(recording: Recording, path: Path) -> Located[ControllersSpec]:
    """The resolved controllers file of a log."""
    return load_controllers_text(attached(recording, path, CONTROLLERS), f"{path.name}/{CONTROLLERS}")


def recorded_robot(recording: Recording, path: Path) -> RobotModel:
    """The robot of a log: from its expanded URDF and its resolved robot file; no mesh is looked for."""
    return rebuild_robot(recorded_robot_file(recording, path).spec, attached(recording, path, URDF))


def recorded_scene(recording: Recording, path: Path) -> Scene:
    """The scene of a log at its start; no mesh is looked for."""
    try:
        return scene_from_json(attached(recording, path, SCENE))
    except ValueError as error:
        message = f"{path.name}/{SCENE}: this is not the scene of a log"
        raise InvalidInput([Finding("LOG103", message)]) from error


def attached(recording: Recording, path: Path, name: str) -> bytes:
    """An attachment.

    Raises:
        InvalidInput: the log has no such attachment.
    """
    if name not in recording.attachments:
        message = f"{path.name}: the log holds no '{name}', without which it cannot be judged"
        raise InvalidInput([Finding("LOG102", message, hint="judge the log as manipcli wrote it, not a filtered copy")])
    return recording.attachments[name]


def known_of(task: Task, log: Path) -> Mapping[str, str | int]:
    """What a report says of a run that has no verdict."""
    simulation = task.spec.simulation
    return {"task": task.name, "seed": simulation.seed, "engine": simulation.engine, "log": str(log)}


def verdict_metadata(verdict: Verdict) -> Mapping[str, Mapping[str, str]]:
    """What the log keeps of its own verdict, for whoever looks at it without manipcli; and up to when it was judged."""
    return {
        STORED: {
            "verdict": verdict.verdict,
            "text": verdict.text,
            UNTIL: repr(verdict.simulated_time),
            **{f"step.{step.id}": step.outcome for step in verdict.steps},
            **{
                f"expect.{e.name}": f"{e.outcome} {'' if e.margin is None else repr(e.margin)} {e.unit}".strip()
                for e in verdict.expectations
            },
        }
    }
