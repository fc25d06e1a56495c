"""Files, robot and scene of a log, from the log alone, without searching for meshes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.model.build_robot import rebuild_robot
from manipcli.model.link_parts import LINK_PARTS
from manipcli.model.robot import LinkInertial, RobotModel
from manipcli.record.attachments import CONTROLLERS, INERTIALS, ROBOT, SCENE, TASK, URDF
from manipcli.record.recording import Recording
from manipcli.scene.scene import Scene
from manipcli.scene.scene_file import scene_from_json
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.load import load_controllers_text, load_robot_text, load_task_text
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import controllers_spec, robot_spec, task_spec


def recorded_task_file(recording: Recording, path: Path) -> Located[TaskSpec]:
    """The resolved task file of a log."""
    return load_task_text(attached(recording, path, TASK), f"{path.name}/{TASK}", model=task_spec())


def recorded_robot_file(recording: Recording, path: Path) -> Located[RobotSpec]:
    """The resolved robot file of a log."""
    return load_robot_text(attached(recording, path, ROBOT), f"{path.name}/{ROBOT}", model=robot_spec())


def recorded_controllers_file(recording: Recording, path: Path) -> Located[ControllersSpec]:
    """The resolved controllers file of a log."""
    name = f"{path.name}/{CONTROLLERS}"
    return load_controllers_text(attached(recording, path, CONTROLLERS), name, model=controllers_spec())


def recorded_robot(recording: Recording, path: Path) -> RobotModel:
    """The robot of a log: from its expanded URDF and resolved robot file, without mesh files."""
    return robot_of(recording, path, recorded_robot_file(recording, path).spec)


def recorded_packages(recording: Recording, path: Path) -> tuple[str, dict[str, str]]:
    """Path of the robot file as the task of a log names it, and its `packages:`."""
    packages = recorded_robot_file(recording, path).spec.packages or {}
    return (recorded_task_file(recording, path).spec.robot, packages) if packages else ("", {})


def robot_of(recording: Recording, path: Path, spec: RobotSpec) -> RobotModel:
    """The robot of a log with this robot file, without mesh files."""
    robot = rebuild_robot(spec, attached(recording, path, URDF), link_parts=recording.attachments.get(LINK_PARTS))
    try:
        inertials = [LinkInertial.read(link, text) for link, text in recording.metadata.get(INERTIALS, {}).items()]
    except ValueError as error:
        raise InvalidInput([Diagnostic("LOG103", f"{path.name}: {error}")]) from error
    return replace(robot, inertials=tuple(inertials))


def recorded_scene(recording: Recording, path: Path) -> Scene:
    """The scene of a log at its start, without mesh files."""
    try:
        return scene_from_json(attached(recording, path, SCENE))
    except ValueError as error:
        message = f"{path.name}/{SCENE}: invalid scene"
        raise InvalidInput([Diagnostic("LOG103", message)]) from error


def attached(recording: Recording, path: Path, name: str) -> bytes:
    """The bytes of an attachment.

    Raises:
        InvalidInput: the log has no such attachment.
    """
    if name not in recording.attachments:
        message = f"{path.name}: attachment '{name}' is missing, the log cannot be judged"
        raise InvalidInput(
            [Diagnostic("LOG102", message, hint="use the log as manipcli wrote it, not a filtered copy")]
        )
    return recording.attachments[name]
