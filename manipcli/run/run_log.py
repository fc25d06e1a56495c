"""The log of a run: its attachments and metadata at the start and at the end."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from manipcli.control.controller import Controller
from manipcli.control.felt_force import FeltForce
from manipcli.control.manager import ControllerManager
from manipcli.control.roles import is_follower, is_hand
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.version import __version__
from manipcli.judge.drawn import SAMPLE
from manipcli.judge.judge import STORED, UNTIL
from manipcli.judge.measured_run import Variant
from manipcli.judge.part import PART
from manipcli.judge.verdict import Verdict
from manipcli.model.link_parts import LINK_PARTS, link_parts_to_json
from manipcli.model.robot import RobotModel
from manipcli.plan.outline import PLAN_FILE
from manipcli.record.attachments import CONTROLLERS, INERTIALS, ROBOT, SCENE, TASK, URDF
from manipcli.record.channels import (
    SENSORS,
    BeliefChannels,
    ControllerChannel,
    MeasuredChannel,
    Recorded,
    SensorChannel,
)
from manipcli.record.faults import RecordingFailed, RecordingRefused
from manipcli.record.messages import portable_name
from manipcli.record.recording import EMBEDDED
from manipcli.record.schemas import WRENCH
from manipcli.record.selection import Selection
from manipcli.record.start_state import START_STATE
from manipcli.record.write.recorder import Recorder
from manipcli.run.belief import Belief
from manipcli.run.embedding import embeddable
from manipcli.run.engine_settings import engine_settings
from manipcli.scene.scene_file import scene_to_json
from manipcli.shapes import primitives
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensor_layout import layout, sensor_frames
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.resolved import resolved
from manipcli.spec.retry import expressions
from manipcli.spec.robot import RobotSpec
from manipcli.spec.sensors import SensorSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

RUNS = Path("runs")
"""Default folder of logs, in the working directory."""
YAML, XML, JSON, BYTES = "application/yaml", "application/xml", "application/json", "application/octet-stream"


def default_log(task: Task) -> Path:
    """`runs/<task>.mcap`, with `@from` for a run from a step on, `@live` for a live session; creates the folder.

    Raises:
        InvalidInput: the folder cannot be created.
    """
    try:
        RUNS.mkdir(exist_ok=True)
    except OSError as error:
        message = f"cannot create folder '{RUNS}' for the log: {error.strerror}"
        raise InvalidInput([Diagnostic("LOG101", message, hint="choose another file with --log PATH")]) from error
    suffix = "@live" if task.part.live else "" if task.part.state is None else "@from"
    return RUNS / f"{task.name}{suffix}.mcap"


def variant_log(log: Path, variant: Variant) -> Path:
    """`runs/pour@mujoco.mcap` for `runs/pour.mcap` in MuJoCo."""
    return log.with_name(f"{log.stem}@{variant.name}{log.suffix}")


@contextmanager
def open_log(
    task: Task, plan: Plan, manager: ControllerManager, path: Path, *, overwrite: bool, embed_meshes: bool
) -> Iterator[Recorder]:
    """A recorder with all attachments and metadata known before the run.

    Args:
        task, plan, manager: of the run.
        path: of the log.
        overwrite: replace an existing log.
        embed_meshes: also attach all mesh files, so that the log can be shown without packages.

    Raises:
        RecordingRefused: the file cannot be written, exists, or is an input of the task.
        RecordingFailed: a write failed during the run; the part written so far stays readable.
    """
    engine = ENGINES[task.spec.simulation.engine]
    meshes = mesh_files(task)
    files = (task.file, task.robot_file, task.controllers_file)
    for read in (*(Path(file.source.name) for file in files), *meshes.values()):
        if path.exists() and read.exists() and path.samefile(read):
            raise RecordingRefused(path, "the task reads this file", hint="choose another name for the log")
    embedded = embeddable(meshes) if embed_meshes else ()
    attachments = [
        (TASK, YAML, resolved(_portable_task(task.spec), expressions(task.file)).encode()),
        (ROBOT, YAML, resolved(_portable_robot(task.robot_file.spec)).encode()),
        (CONTROLLERS, YAML, resolved(task.controllers).encode()),
        (URDF, XML, task.robot.urdf.encode()),
        (SCENE, JSON, scene_to_json(task.true.scene)),
        (PLAN_FILE, JSON, plan.outline.to_json()),
    ]
    if task.part.state is not None:
        attachments.append((START_STATE, JSON, task.part.state.to_json()))
    if (parts := link_parts_to_json(task.robot)) is not None:
        attachments.append((LINK_PARTS, JSON, parts))
    belief = Belief(task.scene, task.true.scene, plan.planner.kinematics)
    recorder = None
    try:
        recorder = Recorder(
            path,
            robot=task.robot,
            scene=task.true.scene,
            controllers=[recorded(controller) for controller in manager.controllers],
            period=task.spec.simulation.control_period,
            attachments=[
                *attachments,
                *((file.attachment, BYTES, file.path.read_bytes()) for file in embedded),
            ],
            metadata={
                "run": _run(task),
                **({"engine": chosen} if (chosen := _chosen(task, plan)) else {}),
                **({SAMPLE: task.drawn.to_metadata()} if task.drawn is not None else {}),
                **({PART: part.to_metadata()} if (part := task.part.described) is not None else {}),
                **({INERTIALS: inertials} if (inertials := _inertials(task)) else {}),
                "versions": {"manipcli": __version__, engine.name: engine.version()},
                "files": {name: hashlib.sha256(content).hexdigest() for name, _, content in attachments},
                "meshes": {uri: hashlib.sha256(path.read_bytes()).hexdigest() for uri, path in meshes.items()},
                **({EMBEDDED: {file.uri: file.attachment for file in embedded}} if embedded else {}),
            },
            selection=Selection(
                task.spec.record.strides(task.spec.simulation.control_period), task.spec.record.left_out
            ),
            overwrite=overwrite,
            live=task.part.live,
            sensors=measured_channels(task.true.sensors, task.true.robot, task.spec.simulation.control_period),
            sensor_frames=sensor_frames(task.true.sensors, task.true.robot),
            belief=BeliefChannels(belief.names, belief.uncertain),
        )
        yield recorder
    except RecordingFailed as failure:
        simulation = task.spec.simulation
        failure.known = {
            "task": task.name,
            "seed": simulation.seed,
            "engine": simulation.engine,
            "log": str(failure.partial),
        }
        raise
    finally:
        if recorder is not None:
            recorder.close_partial()


def _run(task: Task) -> dict[str, str]:
    """Metadata of the run."""
    simulation = task.spec.simulation
    engine = ENGINES[simulation.engine]
    return {
        "task": task.name,
        "seed": str(simulation.seed),
        "engine": engine.name,
        "physics": engine.physics,
        "period": repr(simulation.control_period),
        **({"holding": task.true.robot.holding.kind} if task.true.robot.holding is not None else {}),
    }


def _chosen(task: Task, plan: Plan) -> dict[str, str]:
    """The settings that the engine chose itself."""
    engine = ENGINES[task.spec.simulation.engine]
    return dict(engine.chosen(task.true.robot, task.true.scene, engine_settings(task, plan)))


def _inertials(task: Task) -> dict[str, str]:
    """How the inertials that are not the description's were made, by link."""
    return {row.link: str(row) for row in task.robot.inertials}


def recorded(controller: Controller) -> Recorded:
    """The log channel of a controller; None for a controller that is not recorded."""
    if controller.interfaces:
        return ControllerChannel(controller.name, controller.joints, controller.interfaces, action_of(controller))
    if isinstance(controller, FeltForce):
        return SensorChannel(controller.name, "wrench", WRENCH, controller.frame, 6)
    if not controller.sensors:
        return None
    (request,) = controller.sensors
    return SensorChannel(controller.name, "wrench", WRENCH, request.frame, 6)


def measured_channels(
    sensors: Mapping[str, SensorSpec], robot: RobotModel, period: float
) -> tuple[MeasuredChannel, ...]:
    """The log channels of the sensors of a task; `period` [s] of a control tick."""
    return tuple(
        MeasuredChannel(
            topic=f"{SENSORS}/{name}{topic.suffix}",
            message=topic.type,
            frame=name + topic.frame if isinstance(sensors[name], MountedSpec) else "",
            filled=topic.filled,
            fixed=topic.constant,
            arrived=place.first,
            first=place.first + 1,
            width=place.width,
            every=place.sampling.every,
            delay=place.sampling.delay,
            complete=place.sampling.dropout == 0.0,
            derive=topic.derive,
        )
        for name, place in layout(sensors, robot, period).items()
        for topic in place.topics
    )


def action_of(controller: Controller) -> Literal["", "follow_joint_trajectory", "gripper_cmd"]:
    """The action interface of a controller; "" without one."""
    if is_follower(controller):
        return "follow_joint_trajectory"
    return "gripper_cmd" if is_hand(controller) else ""


def mesh_files(task: Task) -> dict[str, Path]:
    """The mesh files of robot and scene by URI, sorted."""
    geometries = [g for link in task.robot.links for g in (*link.visuals, *link.collisions)]
    geometries += [g for body in task.scene.bodies for g in body.geometries]
    return primitives.mesh_files(geometries)


def _portable_task(spec: TaskSpec) -> TaskSpec:
    """The task with file names that do not depend on this machine."""
    scene = dict(spec.scene)
    for name, body in scene.items():
        for key, shape in (("mesh", body.mesh), ("urdf", body.urdf)):
            if shape is not None:
                portable = shape.model_copy(update={"file": portable_name(shape.file)})
                scene[name] = body.model_copy(update={key: portable})
    files = {"robot": portable_name(spec.robot), "controllers": portable_name(spec.controllers)}
    return spec.model_copy(update={"scene": scene, **files})


def _portable_robot(spec: RobotSpec) -> RobotSpec:
    """The robot file with file names that do not depend on this machine."""
    attach = tuple(part.model_copy(update={"description": portable_name(part.description)}) for part in spec.attach)
    return spec.model_copy(update={"attach": attach, "description": portable_name(spec.description)})


def verdict_metadata(verdict: Verdict) -> Mapping[str, Mapping[str, str]]:
    """The verdict as metadata of its log, for readers without manipcli, and the time [s] of the last judged tick."""
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
            **{f"implied.{e.name}": f"{e.outcome} {e.margin!r}" for e in verdict.implied},
        }
    }
